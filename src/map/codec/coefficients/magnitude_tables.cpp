#include "magnitude_tables.h"

#include <algorithm>

#include "../../format/byte_io.h"

namespace ttsdf {

namespace {

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
