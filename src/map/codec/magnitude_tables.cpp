#include "magnitude_tables.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "../format/byte_io.h"

namespace ttsdf {

namespace {

constexpr int kUnit = 64;
constexpr int kLargestLevel = 127;
/// Magnitudes count at most this much in the averages: outliers would hide the rest.
constexpr std::int32_t kAverageCap = 6;

using SliceSums = std::array<std::vector<double>, 3>;

SliceSums cappedSums(const CoefficientBlock& block) {
  SliceSums sums;
  for (std::size_t axis = 0; axis < 3; ++axis)
    sums[axis].assign(static_cast<std::size_t>(block.extents[axis]), 0.0);
  std::size_t n = 0;
  for (double& of_c : sums[2]) {
    for (double& of_b : sums[1]) {
      double row = 0.0;
      for (double& of_a : sums[0]) {
        const double magnitude = std::min(std::abs(block.values[n++]), kAverageCap);
        of_a += magnitude;
        row += magnitude;
      }
      of_b += row;
      of_c += row;
    }
  }
  return sums;
}

/// Calls visit(level, index) for every coefficient that is not known to be zero, in storage order.
template <typename Visitor>
void visitCoded(const std::vector<MagnitudeTables>& tables, const Visitor& visit) {
  std::uint32_t n = 0;
  for (const MagnitudeTables& block : tables) {
    const auto& [ta, tb, tc] = block.axis;
    for (const int c : tc) {
      for (const int b : tb) {
        if (b == 0 || c == 0) {
          n += static_cast<std::uint32_t>(ta.size());
          continue;
        }
        for (const int a : ta) {
          if (a != 0) visit(a + b + c, n);
          ++n;
        }
      }
    }
  }
}

}  // namespace

MagnitudeTables makeTables(const CoefficientBlock& block) {
  const SliceSums sums = cappedSums(block);
  const auto count = static_cast<double>(block.values.size());
  double total = 0.0;
  for (const double sum : sums[0]) total += sum;
  MagnitudeTables tables;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double per_slice = count / static_cast<double>(block.extents[axis]);
    // The last axis carries the absolute size, the other two are relative to the mean.
    const double reference = axis == 2 ? 1.0 : std::max(total / count, 1e-12);
    for (const double sum : sums[axis]) {
      int level = 0;
      if (sum > 0.0) {
        const auto quarters = static_cast<int>(std::lround(4.0 * std::log2(sum / per_slice / reference)));
        level = std::clamp(kUnit + quarters, 1, kLargestLevel);
      }
      tables.axis[axis].push_back(static_cast<std::uint8_t>(level));
    }
  }
  return tables;
}

std::vector<std::uint8_t> packTables(const std::vector<MagnitudeTables>& tables) {
  std::vector<std::uint8_t> packed;
  for (const MagnitudeTables& block : tables) {
    for (const auto& table : block.axis) {
      std::uint8_t before = 0;
      for (const std::uint8_t level : table) {
        packed.push_back(static_cast<std::uint8_t>(level - before));
        before = level;
      }
    }
  }
  return packed;
}

std::vector<MagnitudeTables> unpackTables(const std::vector<std::uint8_t>& packed,
                                          const std::vector<std::array<int, 3>>& extents,
                                          const std::string& what) {
  std::vector<MagnitudeTables> tables(extents.size());
  auto next = packed.begin();
  for (std::size_t k = 0; k < extents.size(); ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::uint8_t level = 0;
      for (int n = 0; n < extents[k][axis]; ++n) {
        level = static_cast<std::uint8_t>(level + *next++);
        if (level > kLargestLevel) refuse(what + ": table of magnitudes", std::to_string(level), "0 to 127");
        tables[k].axis[axis].push_back(level);
      }
    }
  }
  return tables;
}

std::vector<std::uint32_t> expectedOrder(const std::vector<MagnitudeTables>& tables) {
  constexpr int kClasses = 3 * kLargestLevel + 1;
  const auto classOf = [](int level) { return static_cast<std::size_t>(3 * kLargestLevel - level); };
  std::array<std::size_t, kClasses> next{};
  std::size_t coded = 0;
  visitCoded(tables, [&](int level, std::uint32_t) { ++next[classOf(level)], ++coded; });
  std::size_t before = 0;
  for (std::size_t& start : next) {
    const std::size_t size = start;
    start = before;
    before += size;
  }
  std::vector<std::uint32_t> order(coded);
  visitCoded(tables, [&](int level, std::uint32_t n) { order[next[classOf(level)]++] = n; });
  return order;
}

}  // namespace ttsdf
