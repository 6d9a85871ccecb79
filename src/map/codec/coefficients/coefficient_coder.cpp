#include "coefficient_coder.h"

#include <algorithm>
#include <cstdlib>

#include "../bits.h"
#include "../byte_compression.h"
#include "magnitude_tables.h"

namespace ttsdf {

namespace {

/// One bit each for "is it above n", n = 0, 1, 2; what is left goes to bytes.
constexpr std::int32_t kLayers = 3;
constexpr int kMaxVarintBytes = 4;

std::uint32_t takeVarint(ByteReader& in) {
  std::uint32_t value = 0;
  for (int n = 0; n < kMaxVarintBytes; ++n) {
    const std::uint8_t byte = in.u8();
    value |= static_cast<std::uint32_t>(byte & 127u) << (7 * n);
    if (byte < 128) break;
  }
  return value;
}

std::vector<std::uint8_t> readStream(ByteReader& in, std::size_t raw_size) {
  ByteReader coded = in.block(in.what());
  const std::size_t size = coded.remaining();
  return decompressBytes(coded.take(size), size, raw_size, in.what());
}

/// Adds what exceeds the layers to the magnitudes at `large`.
void readLarge(ByteReader& in, const std::vector<std::uint32_t>& large,
               std::vector<std::int32_t>& magnitudes) {
  const std::size_t size = in.u32();
  if (size < large.size() || size > kMaxVarintBytes * large.size()) {
    refuse(in.what() + ": bytes of large coefficients", std::to_string(size),
           std::to_string(large.size()) + " to " + std::to_string(kMaxVarintBytes * large.size()));
  }
  const std::vector<std::uint8_t> raw = readStream(in, size);
  ByteReader bytes(raw.data(), raw.size(), in.what() + ": large coefficients");
  for (const std::uint32_t n : large) {
    const std::uint32_t value = takeVarint(bytes);
    if (value > static_cast<std::uint32_t>(kMaxCoefficient - kLayers)) {
      refuse(bytes.what(), std::to_string(value), "at most " + std::to_string(kMaxCoefficient - kLayers));
    }
    magnitudes[n] += static_cast<std::int32_t>(value);
  }
  bytes.expectEnd();
}

}  // namespace

CoefficientBlock::CoefficientBlock(int n0, int n1, int n2) : extents{{n0, n1, n2}} {
  values.assign(static_cast<std::size_t>(n0) * static_cast<std::size_t>(n1) * static_cast<std::size_t>(n2),
                0);
}

void readCoefficients(ByteReader& in, const std::vector<CoefficientBlock*>& blocks) {
  std::vector<std::array<int, 3>> extents;
  std::size_t table_bytes = 0, count = 0;
  for (const CoefficientBlock* block : blocks) {
    extents.push_back(block->extents);
    for (const int extent : block->extents) table_bytes += static_cast<std::size_t>(extent);
    count += block->values.size();
  }
  const std::vector<std::uint32_t> order =
      expectedOrder(unpackTables(readStream(in, table_bytes), extents, in.what()));

  std::vector<std::int32_t> all(count, 0);
  std::vector<std::uint32_t> alive = order;
  std::size_t nonzero = 0;
  for (std::int32_t layer = 0; layer < kLayers; ++layer) {
    const std::vector<std::uint8_t> above = readStream(in, (alive.size() + 7) / 8);
    std::size_t kept = 0;
    for (std::size_t n = 0; n < alive.size(); ++n) {
      if (!bitAt(above.data(), n)) continue;
      all[alive[n]] = layer + 1;
      alive[kept++] = alive[n];
    }
    alive.resize(kept);
    if (layer == 0) nonzero = kept;
  }
  readLarge(in, alive, all);

  const std::uint8_t* const signs = in.take((nonzero + 7) / 8);
  std::size_t sign = 0;
  for (const std::uint32_t n : order) {
    if (all[n] != 0 && bitAt(signs, sign++)) all[n] = -all[n];
  }
  auto from = all.begin();
  for (CoefficientBlock* block : blocks) {
    std::copy_n(from, block->values.size(), block->values.begin());
    from += static_cast<std::ptrdiff_t>(block->values.size());
  }
}

}  // namespace ttsdf
