#pragma once
// A train has many equal forms. This one makes quantisation simple: U and V have orthonormal columns, so an
// error of the middle core is an error of the same size in the full array, spread evenly; and the slices of
// the middle core are sorted by what they contribute.

#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {

/// F = sum_ab U(:, a) x M(a, :, b) x V(:, b).
struct TrainGauge {
  ModeOrder axes{};
  Eigen::MatrixXf U;  ///< n1 x r1, orthonormal columns
  Eigen::MatrixXf M;  ///< (r1 r2) x n2: column j is slice j, column-major
  Eigen::MatrixXf V;  ///< n3 x r2, orthonormal columns

  int rank1() const { return static_cast<int>(U.cols()); }
  int rank2() const { return static_cast<int>(V.cols()); }
};

/// Orthonormal U and V, else as near to the given cores as can be.
TrainGauge orthonormalGauge(const TensorTrain& train);

/// Turns U and V so that the slices of M are orthogonal and sorted, strongest first: most of M in few
/// numbers. Components that carry nothing (below 1e-7 of the largest) are dropped; at least one stays.
TrainGauge principalGauge(const TrainGauge& gauge);

/// Euclidean norms of M's slices M(a, :, :) and M(:, :, b).
Eigen::VectorXd sliceNorms1(const Eigen::MatrixXf& M, int rank1);
Eigen::VectorXd sliceNorms2(const Eigen::MatrixXf& M, int rank1);

/// M(a, j, b) -> sum A(a', a) M(a, j, b) B(b', b), i.e. A M_j B^T for every slice.
Eigen::MatrixXf changeBasis(const Eigen::MatrixXf& A, const Eigen::MatrixXf& M, const Eigen::MatrixXf& B);

}  // namespace ttsdf
