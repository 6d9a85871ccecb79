#pragma once
// What a decoder knows of the coefficients before it reads them: how large they are on average in every slice
// of every axis. The sum of three tables (they are logarithms) predicts the magnitude of a coefficient.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "coefficient_coder.h"

namespace ttsdf {

struct MagnitudeTables {
  /// Quarter octaves around 64 = magnitude 1; 0: every coefficient of this slice is zero.
  std::array<std::vector<std::uint8_t>, 3> axis;
};

constexpr int kLargestLevel = 127;

/// One byte per entry, as differences along each axis: neighbours are alike. Throws MapFormatError, naming
/// `what`. `packed` has as many bytes as the blocks have slices.
std::vector<MagnitudeTables> unpackTables(const std::vector<std::uint8_t>& packed,
                                          const std::vector<std::array<int, 3>>& extents,
                                          const std::string& what);

/// The coefficients that are not known to be zero, the largest expected first, ties in storage order: indices
/// into the blocks' values one after the other.
std::vector<std::uint32_t> expectedOrder(const std::vector<MagnitudeTables>& tables);

}  // namespace ttsdf
