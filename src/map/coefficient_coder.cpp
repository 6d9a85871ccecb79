#include "coefficient_coder.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "byte_compression.h"

namespace ttsdf {

namespace {

/// Tables hold quarter octaves around kUnit = magnitude 1; 0 = every coefficient of this slice is zero.
constexpr int kUnit = 64;
constexpr int kLargestLevel = 127;
/// Magnitudes count at most this much in the averages: outliers would hide the rest.
constexpr std::int32_t kAverageCap = 6;
/// One bit each for "is it above n", n = 0, 1, 2; what is left goes to bytes.
constexpr std::int32_t kLayers = 3;

using Table = std::vector<std::uint8_t>;
struct BlockTables {
  std::array<Table, 3> axis;
};

int quarterOctaves(double magnitude) { return static_cast<int>(std::lround(4.0 * std::log2(magnitude))); }

/// Mean capped magnitude of every slice of every axis, as a product model: table sums = log of the
/// expectation.
BlockTables makeTables(const CoefficientBlock& block) {
  std::array<std::vector<double>, 3> sums;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    sums[axis].assign(static_cast<std::size_t>(block.extents[axis]), 0.0);
  }
  double total = 0.0;
  std::size_t n = 0;
  for (std::size_t c = 0; c < sums[2].size(); ++c) {
    for (std::size_t b = 0; b < sums[1].size(); ++b) {
      for (std::size_t a = 0; a < sums[0].size(); ++a, ++n) {
        const double magnitude = std::min(std::abs(block.values[n]), kAverageCap);
        sums[0][a] += magnitude, sums[1][b] += magnitude, sums[2][c] += magnitude;
        total += magnitude;
      }
    }
  }
  BlockTables tables;
  const auto count = static_cast<double>(block.values.size());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double per_slice = count / static_cast<double>(block.extents[axis]);
    // The last axis carries the absolute size, the other two are relative to the mean.
    const double reference = axis == 2 ? 1.0 : std::max(total / count, 1e-12);
    for (const double sum : sums[axis]) {
      const int level = sum > 0.0 ? kUnit + quarterOctaves(sum / per_slice / reference) : 0;
      tables.axis[axis].push_back(
          static_cast<std::uint8_t>(sum > 0.0 ? std::clamp(level, 1, kLargestLevel) : 0));
    }
  }
  return tables;
}

struct Position {
  std::uint32_t block, index;
};

/// The coefficients that are not known to be zero, the largest expected first; ties in storage order.
template <typename Blocks, typename Visitor>
void visitCoded(const Blocks& blocks, const std::vector<BlockTables>& tables, const Visitor& visit) {
  for (std::uint32_t k = 0; k < blocks.size(); ++k) {
    const auto& [ta, tb, tc] = tables[k].axis;
    std::uint32_t n = 0;
    for (const int c : tc) {
      for (const int b : tb) {
        if (b == 0 || c == 0) {
          n += static_cast<std::uint32_t>(ta.size());
          continue;
        }
        for (const int a : ta) {
          if (a != 0) visit(a + b + c - 2 * kUnit, Position{k, n});
          ++n;
        }
      }
    }
  }
}

std::vector<Position> sortedPositions(const std::vector<CoefficientBlock>& blocks,
                                      const std::vector<BlockTables>& tables) {
  constexpr int kClasses = 3 * kLargestLevel + 1;
  const auto classOf = [](int level) {
    return static_cast<std::size_t>(kLargestLevel * 3 - 2 * kUnit - level);
  };
  std::array<std::size_t, kClasses> start{};
  std::size_t coded = 0;
  visitCoded(blocks, tables, [&](int level, Position) { ++start[classOf(level)], ++coded; });
  std::size_t before = 0;
  for (std::size_t& s : start) {
    const std::size_t size = s;
    s = before;
    before += size;
  }
  std::vector<Position> sorted(coded);
  visitCoded(blocks, tables, [&](int level, Position at) { sorted[start[classOf(level)]++] = at; });
  return sorted;
}

/// Tables as differences along each axis: neighbours are alike.
std::vector<std::uint8_t> packTables(const std::vector<BlockTables>& tables) {
  std::vector<std::uint8_t> packed;
  for (const BlockTables& block : tables) {
    for (const Table& table : block.axis) {
      std::uint8_t before = 0;
      for (const std::uint8_t level : table) {
        packed.push_back(static_cast<std::uint8_t>(level - before));
        before = level;
      }
    }
  }
  return packed;
}

std::vector<BlockTables> unpackTables(const std::vector<std::uint8_t>& packed,
                                      const std::vector<CoefficientBlock>& blocks, const std::string& what) {
  std::vector<BlockTables> tables(blocks.size());
  auto next = packed.begin();
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::uint8_t level = 0;
      for (int n = 0; n < blocks[k].extents[axis]; ++n) {
        level = static_cast<std::uint8_t>(level + *next++);
        if (level > kLargestLevel) refuse(what + ": table of magnitudes", std::to_string(level), "0 to 127");
        tables[k].axis[axis].push_back(level);
      }
    }
  }
  return tables;
}

class BitPacker {
 public:
  void push(bool bit) {
    if (count_ % 8 == 0) bytes_.push_back(0);
    bytes_.back() = static_cast<std::uint8_t>(bytes_.back() | (static_cast<unsigned>(bit) << (count_ % 8)));
    ++count_;
  }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
  std::size_t count_ = 0;
};

bool bitAt(const std::uint8_t* bytes, std::size_t n) { return (bytes[n / 8] >> (n % 8)) & 1u; }

/// Seven bits per byte, the low ones first; small numbers take one byte.
void pushVarint(std::vector<std::uint8_t>& bytes, std::uint32_t value) {
  for (; value >= 128; value >>= 7) bytes.push_back(static_cast<std::uint8_t>(value | 128u));
  bytes.push_back(static_cast<std::uint8_t>(value));
}

std::vector<std::uint8_t> readStream(ByteReader& in, std::size_t raw_size) {
  ByteReader coded = in.block(in.what());
  const std::size_t size = coded.remaining();
  return decompressBytes(coded.take(size), size, raw_size, in.what());
}

}  // namespace

CoefficientBlock::CoefficientBlock(int n0, int n1, int n2) : extents{{n0, n1, n2}} {
  values.assign(static_cast<std::size_t>(n0) * static_cast<std::size_t>(n1) * static_cast<std::size_t>(n2),
                0);
}

void writeCoefficients(const std::vector<CoefficientBlock>& blocks, ByteWriter& out) {
  std::vector<BlockTables> tables;
  for (const CoefficientBlock& block : blocks) tables.push_back(makeTables(block));
  out.block(compressBytes(packTables(tables)));

  std::vector<std::int32_t> values;
  for (const Position at : sortedPositions(blocks, tables))
    values.push_back(blocks[at.block].values[at.index]);
  BitPacker signs;
  for (const std::int32_t value : values) {
    if (value != 0) signs.push(value < 0);
  }
  for (std::int32_t layer = 0; layer < kLayers; ++layer) {
    BitPacker above;
    std::size_t kept = 0;
    for (const std::int32_t value : values) {
      const bool larger = std::abs(value) > layer;
      above.push(larger);
      if (larger) values[kept++] = value;
    }
    values.resize(kept);
    out.block(compressBytes(above.bytes()));
  }
  std::vector<std::uint8_t> rest;
  for (const std::int32_t value : values) {
    pushVarint(rest, static_cast<std::uint32_t>(std::abs(value) - kLayers));
  }
  out.u32(static_cast<std::uint32_t>(rest.size()));
  out.block(compressBytes(rest));
  out.bytes(signs.bytes());
}

void readCoefficients(ByteReader& in, std::vector<CoefficientBlock>& blocks) {
  std::size_t table_bytes = 0;
  for (const CoefficientBlock& block : blocks) {
    for (const int extent : block.extents) table_bytes += static_cast<std::size_t>(extent);
  }
  const std::vector<BlockTables> tables = unpackTables(readStream(in, table_bytes), blocks, in.what());
  std::vector<Position> order = sortedPositions(blocks, tables);

  std::vector<std::size_t> alive(order.size());
  for (std::size_t n = 0; n < alive.size(); ++n) alive[n] = n;
  std::vector<std::int32_t> magnitudes(order.size(), 0);
  for (std::int32_t layer = 0; layer < kLayers; ++layer) {
    const std::vector<std::uint8_t> above = readStream(in, (alive.size() + 7) / 8);
    std::size_t kept = 0;
    for (std::size_t n = 0; n < alive.size(); ++n) {
      if (!bitAt(above.data(), n)) continue;
      magnitudes[alive[n]] = layer + 1;
      alive[kept++] = alive[n];
    }
    alive.resize(kept);
  }
  const std::size_t rest_size = in.u32();
  if (rest_size < alive.size() || rest_size > 4 * alive.size()) {
    refuse(in.what() + ": bytes of large coefficients", std::to_string(rest_size),
           std::to_string(alive.size()) + " to " + std::to_string(4 * alive.size()));
  }
  const std::vector<std::uint8_t> rest = readStream(in, rest_size);
  ByteReader bytes(rest.data(), rest.size(), in.what() + ": large coefficients");
  for (const std::size_t n : alive) {
    std::uint32_t value = 0;
    int shift = 0;
    std::uint8_t byte = 0;
    do {
      byte = bytes.u8();
      value |= static_cast<std::uint32_t>(byte & 127u) << shift;
      shift += 7;
    } while (byte >= 128 && shift < 28);
    if (value > static_cast<std::uint32_t>(kMaxCoefficient - kLayers)) {
      refuse(in.what() + ": coefficient", std::to_string(value),
             "at most " + std::to_string(kMaxCoefficient));
    }
    magnitudes[n] += static_cast<std::int32_t>(value);
  }
  bytes.expectEnd();

  const auto nonzero = static_cast<std::size_t>(
      std::count_if(magnitudes.begin(), magnitudes.end(), [](std::int32_t m) { return m != 0; }));
  const std::uint8_t* const signs = in.take((nonzero + 7) / 8);
  std::size_t sign = 0;
  for (std::size_t n = 0; n < order.size(); ++n) {
    const std::int32_t magnitude = magnitudes[n];
    if (magnitude == 0) continue;
    blocks[order[n].block].values[order[n].index] = bitAt(signs, sign++) ? -magnitude : magnitude;
  }
}

}  // namespace ttsdf
