#pragma once
// The one heavy kernel of TT-SVD: a Gram matrix in double of a float matrix.

#include <Eigen/Core>

namespace ttsdf {

/// gram (n x n, lower triangle) += A A^T for A (n x m, column-major, m contiguous columns). Double
/// accumulation: a float Gram loses 2-3 % of accuracy, and squaring costs half the digits. Dispatched at run
/// time to the widest vectors.
void addGram(const Eigen::Ref<const Eigen::MatrixXf>& A, Eigen::MatrixXd& gram);

}  // namespace ttsdf
