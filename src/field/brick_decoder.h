#pragma once
// Decompression of a map in bricks of 8 x 8 x 8 samples, which hold the corners of 7 x 7 x 7 cells.
//
// For a pair (i, j) of first and middle index the column c_ij = G1(i, :) G2(:, j, :) is contracted once; a
// sample is then its dot product with a column of the last core.

#include <array>
#include <cstddef>
#include <vector>

#include "block_cache.h"
#include "column_kernels.h"
#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {

constexpr int kBrickCells = 7;               ///< cells along an edge
constexpr int kBrickSide = kBrickCells + 1;  ///< samples along an edge
constexpr int kBrickSamples = kBrickSide * kBrickSide * kBrickSide;

/// Not thread-safe: decode uses the cache of columns.
class BrickDecoder {
 public:
  /// Keeps at most `cache_bytes` of contracted columns (at least one block of them).
  BrickDecoder(const TensorTrain& train, const ColumnKernels& kernels, std::size_t cache_bytes);

  /// Bricks along the first, middle and last mode.
  const std::array<int, 3>& bricks() const { return bricks_; }
  /// Samples of brick (a, b, c), chain order, first index fastest. Behind the last sample of a mode it is
  /// repeated.
  void decode(int a, int b, int c, float* samples);

  /// Cores as laid out here, and columns held [bytes].
  std::size_t memoryBytes() const;
  std::size_t cacheBytes() const { return columns_.memoryBytes(); }

 private:
  void layOutFirst(const TensorTrain& train);
  void layOutMiddle(const TensorTrain& train);
  void layOutLast(const TensorTrain& train);
  /// The kBrickSide columns of brick column `a` and middle index j.
  const float* columns(int a, int j);

  const ColumnKernels& kernels_;
  std::array<int, 3> bricks_;
  int middle_size_, rank1_;
  int width_;                                 // floats of a column, padded
  std::vector<float> first_, middle_, last_;  // row-major, rows padded with zeros
  BlockCache columns_;
};

}  // namespace ttsdf
