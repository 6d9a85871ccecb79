#pragma once
// The tensor train of a three-dimensional array (paper, equation (8)):
//   F(x) = G1(i1, :) * G2(:, i2, :) * G3(:, i3),   (i1, i2, i3) = the entries of x in the order of `axes`.

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "ttsdf_localization/tensor/dense_tensor.h"

namespace ttsdf {

/// Which array axis (0 = x, 1 = y, 2 = z) is the first, the middle and the last mode of the train.
using ModeOrder = std::array<int, 3>;

/// The order that needs least memory: the smallest extent in the middle, the other two in their natural
/// order.
ModeOrder defaultModeOrder(const Dims& dims);

class TensorTrain {
 public:
  TensorTrain() = default;
  /// first: n1 x r1; middle: r1 x (n2 * r2), slice j in columns [j r2, (j+1) r2); last: r2 x n3.
  /// Throws std::invalid_argument if the shapes do not fit each other or `axes` is no permutation.
  TensorTrain(ModeOrder axes, Eigen::MatrixXf first, Eigen::MatrixXf middle, Eigen::MatrixXf last);

  const ModeOrder& axes() const { return axes_; }
  /// Extents in array order (x, y, z).
  Dims dims() const;
  /// Extents in chain order (n1, n2, n3).
  std::array<int, 3> modeSizes() const;
  int rank1() const { return static_cast<int>(first_.cols()); }
  int rank2() const { return static_cast<int>(last_.rows()); }

  const Eigen::MatrixXf& first() const { return first_; }
  const Eigen::MatrixXf& middle() const { return middle_; }
  const Eigen::MatrixXf& last() const { return last_; }
  /// Slice j of the middle core, r1 x r2.
  auto slice(int j) const {
    return middle_.middleCols(static_cast<Eigen::Index>(j) * last_.rows(), last_.rows());
  }

  /// One entry, array indices; O(r1 r2). Indices are not checked.
  float operator()(int x, int y, int z) const;

  /// Numbers stored: n1 r1 + r1 n2 r2 + r2 n3 (paper, section IV).
  std::size_t parameterCount() const;
  /// Bytes of the cores in memory.
  std::size_t memoryBytes() const { return parameterCount() * sizeof(float); }

 private:
  ModeOrder axes_{{0, 1, 2}};
  Eigen::MatrixXf first_, middle_, last_;
};

/// The whole array; O(n1 n2 r1 r2 + n1 n2 n3 r2).
DenseTensor full(const TensorTrain& tt);

/// Applies a matrix (m x n_axis) to one array axis: (D F)(.., a, ..) = sum_b matrix(a, b) F(.., b, ..).
/// Touches one core only (paper, section IV-A, Proposition). Throws std::invalid_argument for another axis
/// than 0, 1, 2 or a matrix that does not fit.
TensorTrain applyToMode(const TensorTrain& tt, int axis, const Eigen::MatrixXf& matrix);

/// Partial derivative along an array axis by finite differences of second order, one-sided at both ends:
/// exact for polynomials up to degree two (paper, equation (11)). `step` is the grid spacing [m]. Needs an
/// extent of at least 3; with 2 the difference quotient, with 1 zero. Throws std::invalid_argument for a step
/// that is not positive.
/// Deviates from the paper: the printed D_N has the signs of its interior and last rows wrong.
TensorTrain differentiate(const TensorTrain& tt, int axis, double step);

/// Sum of two trains of equal dims and axes; ranks add up (`round` brings them down again). Throws
/// std::invalid_argument if they differ.
TensorTrain add(const TensorTrain& a, const TensorTrain& b);
TensorTrain scale(const TensorTrain& tt, float factor);
/// Entries [begin, begin + size) of every array axis. Throws std::invalid_argument for a box not inside.
TensorTrain crop(const TensorTrain& tt, const Dims& begin, const Dims& size);

/// Frobenius norm, computed on the cores.
double norm(const TensorTrain& tt);

}  // namespace ttsdf
