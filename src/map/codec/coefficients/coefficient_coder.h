#pragma once
// Entropy coding of quantised coefficients with a library coder.
//
// Small tables say how large the coefficients of every row, column and frequency are on average; their sum
// (they are logarithms) predicts the magnitude of each coefficient. Sorted by that prediction, from large to
// small, the magnitudes become streams whose statistics drift slowly, which is what an adaptive coder is best
// at. The decoder repeats the sorting from the tables.

#include <array>
#include <cstdint>
#include <vector>

#include "../../format/byte_io.h"

namespace ttsdf {

/// Integer coefficients of a box of `extents`, first index fastest.
struct CoefficientBlock {
  CoefficientBlock() = default;
  CoefficientBlock(int n0, int n1, int n2);
  std::array<int, 3> extents{};
  std::vector<std::int32_t> values;
};

/// Largest magnitude that can be coded.
constexpr std::int32_t kMaxCoefficient = (1 << 24) - 1;

/// Fills blocks of known extents. Throws MapFormatError.
void readCoefficients(ByteReader& in, const std::vector<CoefficientBlock*>& blocks);

}  // namespace ttsdf
