#pragma once
// How quantised coefficients become bits: magnitudes in unary with a bounded number of steps and an
// exponential Golomb code above, every decision with a probability from what is around the coefficient.
// Reader and writer walk through a box in the same order; the reader learns the magnitudes on the way.

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "../bit_model.h"
#include "coefficient_coder.h"

namespace ttsdf {

/// `Coder` has `bool code(bool bit, int probability)`: a writer stores `bit` and returns it, a reader returns
/// what was stored; and `check()`, called now and then, with which a reader ends what makes no sense.
/// Probabilities of a 1 in 4096ths.
template <class Coder>
class CoefficientModel {
 public:
  explicit CoefficientModel(Coder& coder) : coder_(coder) {}

  /// Codes all coefficients of the box, the first index fastest, and knows nothing of the boxes before.
  void code(CoefficientBlock& block);

 private:
  static constexpr int kUnary = 16;      ///< magnitudes below are coded in unary
  static constexpr int kDecisions = 40;  ///< unary and the lengths above
  static constexpr int kLevels = 24;     ///< classes of expected magnitudes
  static constexpr int kCap = 40;        ///< magnitudes count at most this much in averages
  static constexpr int kOne = 256;       ///< a magnitude of 1 in averages

  /// Half octaves; 16 is one.
  static int level(std::int64_t scaled) {
    int result = 0;
    // 2^((result - 9) / 2) <= scaled / 16
    static constexpr std::int32_t kFrom[kLevels] = {1,   2,   3,   4,   5,    6,    8,    11,
                                                    16,  23,  32,  45,  64,   91,   128,  181,
                                                    256, 362, 512, 724, 1024, 1448, 2048, 2896};
    while (result < kLevels - 1 && scaled >= kFrom[result]) ++result;
    return result;
  }
  static std::uint32_t pair(int a, int b) { return static_cast<std::uint32_t>(a * kLevels + b); }

  bool decide(bool bit, int decision) {
    std::array<std::uint32_t, kContexts> places;
    for (std::size_t n = 0; n < kContexts; ++n)
      places[n] = contexts_[n] * kDecisions + static_cast<std::uint32_t>(decision);
    const bool result =
        coder_.code(bit, model_.predict(places, static_cast<std::size_t>(decision * kLevels + set_)));
    model_.learn(result);
    return result;
  }
  std::int32_t magnitude(std::int32_t known);

  Coder& coder_;
  BitModel model_{kLevels * kLevels * kDecisions, kDecisions* kLevels};
  std::array<std::uint32_t, kContexts> contexts_{};
  int set_ = 0;
};

template <class Coder>
std::int32_t CoefficientModel<Coder>::magnitude(std::int32_t known) {
  std::int32_t value = 0;
  while (value < kUnary && decide(known > value, value)) ++value;
  if (value < kUnary) return value;
  const std::uint32_t rest = static_cast<std::uint32_t>(known - kUnary) + 1;  // of no meaning to a reader
  int length = 0;
  while (length < 24 && decide((rest >> 1) >> length != 0, std::min(kUnary + length, kDecisions - 1)))
    ++length;
  std::uint32_t number = 1;
  for (int n = length - 1; n >= 0; --n)
    number = number << 1 | static_cast<std::uint32_t>(coder_.code((rest >> n) & 1u, 2048));
  return static_cast<std::int32_t>(number - 1) + kUnary;
}

template <class Coder>
void CoefficientModel<Coder>::code(CoefficientBlock& block) {
  const int n0 = block.extents[0], n1 = block.extents[1], n2 = block.extents[2];
  const auto rows = static_cast<std::size_t>(n0), columns = static_cast<std::size_t>(n1);
  const auto at = [&](int a, int b, int c) -> std::int32_t {
    if (a < 0 || b < 0 || c < 0 || a >= n0 || b >= n1) return 0;
    return std::abs(
        block.values[static_cast<std::size_t>(a) +
                     rows * (static_cast<std::size_t>(b) + columns * static_cast<std::size_t>(c))]);
  };
  model_.forget();
  std::vector<std::int32_t> entry(rows * columns), row(rows), column(columns), across(rows);
  std::vector<std::int32_t> row_sum(rows), column_sum(columns), row_before(rows), column_before(columns);
  std::size_t n = 0;
  for (int c = 0; c < n2; ++c) {
    for (std::size_t a = 0; a < rows; ++a) row_before[a] = row_sum[a] / n1, row_sum[a] = 0;
    for (std::size_t b = 0; b < columns; ++b) column_before[b] = column_sum[b] / n0, column_sum[b] = 0;
    for (int b = 0; b < n1; ++b) {
      coder_.check();
      std::int32_t along = 0;
      const auto ub = static_cast<std::size_t>(b);
      for (int a = 0; a < n0; ++a, ++n) {
        const auto ua = static_cast<std::size_t>(a);
        std::int32_t& same = entry[ua + rows * ub];
        const std::int32_t before = at(a, b, c - 1), two_before = at(a, b, c - 2);
        const std::int32_t beside =
            2 * at(a - 1, b, c) + 2 * at(a, b - 1, c) + at(a - 1, b - 1, c) + at(a + 1, b - 1, c);
        const std::int32_t around =
            at(a + 1, b, c - 1) + at(a, b + 1, c - 1) + at(a - 1, b, c - 1) + at(a, b - 1, c - 1);
        const std::int64_t earlier = (2 * std::int64_t{before} + two_before) * kOne / 3;
        const std::int64_t expected = (5 * std::int64_t{same} + 5 * earlier + 10 * along + 6 * across[ua] +
                                       3 * column_before[ub] + 3 * row_before[ua]) /
                                      32;
        const auto of = [](std::int64_t average) { return level(average / 16); };
        set_ = of(expected);
        contexts_ = {pair(of(same), level(16 * before)),
                     pair(of(row[ua]), of(column[ub])),
                     pair(level(16 * beside / 6), level(4 * around)),
                     pair(set_, level(16 * beside / 6)),
                     pair(of(along), of(across[ua])),
                     pair(level(earlier / 16), level(16 * (2 * at(a, b - 1, c) + at(a, b - 2, c)) / 3)),
                     pair(of(column_before[ub]), of(row_before[ua])),
                     pair(set_, 0)};
        std::int32_t& value = block.values[n];
        const std::int32_t size = std::min(magnitude(std::abs(value)), kMaxCoefficient);
        bool negative = false;
        if (size != 0) negative = coder_.code(value < 0, 2048);
        value = negative ? -size : size;
        const std::int32_t counted = std::min(size, kCap) * kOne;
        same = c == 0 ? counted : same + (counted - same) / 4;
        row[ua] += (counted - row[ua]) / 16;
        column[ub] += (counted - column[ub]) / 16;
        along += (counted - along) / 4;
        across[ua] += (counted - across[ua]) / 4;
        row_sum[ua] += counted;
        column_sum[ub] += counted;
      }
    }
  }
}

}  // namespace ttsdf
