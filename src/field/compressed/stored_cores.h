#pragma once
// The cores of a train as they are kept for evaluation: 16-bit numbers, and the arithmetic on them.
//
//   F(i, j, k) = G1(i, :) G2(:, j, :) G3(:, k)
//
// A column c = G1(i, :) G2(:, j, :) is contracted once for four neighbouring i; a sample is then one dot
// product of whole numbers. The integer sums of a dot product cannot overflow: the longer it is, the fewer
// bits its factors have (13 at least up to rank 128).

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {

constexpr int kColumnBlock = 4;   ///< columns contracted together: neighbours along the first mode
constexpr int kRowsTogether = 8;  ///< rows of the last core that columns are multiplied with together

/// kColumnBlock columns: a scale of each [m], then width() numbers of each.
struct ColumnBlock {
  const float* scale;
  const std::int16_t* numbers;
};

class StoredCores {
 public:
  explicit StoredCores(const TensorTrain& train);

  const std::array<int, 3>& sizes() const { return sizes_; }
  const ModeOrder& axes() const { return axes_; }
  int rank1() const { return rank1_; }
  int rank2() const { return rank2_; }
  /// Numbers of a column, padded with zeros.
  int width() const { return width_; }
  /// Blocks along the first mode.
  int blocks() const { return (sizes_[0] + kColumnBlock - 1) / kColumnBlock; }

  /// Columns [kColumnBlock a, ...) of slice j; behind the last row its neighbour is repeated.
  void contract(int a, int j, float* scale, std::int16_t* numbers) const;
  /// Row k of the last core: a sample is scale * lastScale(k) * dot(column, row).
  const std::int16_t* last(int k) const { return &last_[static_cast<std::size_t>(k) * width()]; }
  float lastScale(int k) const { return last_scale_[static_cast<std::size_t>(k)]; }

  /// Rows [k, k + kRowsTogether) of the last core and their scales; behind the last row it is repeated.
  /// pairs[n][m]: numbers 2n and 2n + 1 of row k + m; width() / 2 of them.
  void rowsTogether(int k, std::int32_t (*pairs)[kRowsTogether], float* scale) const;

  std::size_t memoryBytes() const;

 private:
  ModeOrder axes_{};
  std::array<int, 3> sizes_{};
  int rank1_ = 0, rank2_ = 0, width_ = 0;
  float largest_ = 0.0f;              // of the numbers of columns and rows of the last core
  std::vector<float> first_;          // rank1 numbers per row
  std::vector<std::int16_t> middle_;  // [slice][row a][width]
  std::vector<float> middle_scale_;   // [slice][row a]
  std::vector<std::int16_t> last_;    // [k][width]
  std::vector<float> last_scale_;
};

/// out[r][q] = dot(columns[q], rows[r]) for four columns and two rows of `width` numbers (a multiple of 8).
void dotProducts(const std::int16_t* const columns[4], const std::int16_t* const rows[2], int width,
                 std::int32_t (*out)[4]);
/// out[q][m] = dot(columns[q], row m) for four columns and the rows of StoredCores::rowsTogether.
void dotProducts(const std::int16_t* const columns[4], const std::int32_t (*pairs)[kRowsTogether], int width,
                 std::int32_t (*out)[kRowsTogether]);

}  // namespace ttsdf
