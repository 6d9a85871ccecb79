#pragma once
// The one heavy kernel of TT-SVD: a Gram matrix in double of a float matrix.

#include <Eigen/Core>
#include <vector>

namespace ttsdf {

/// gram (n x n, lower triangle) += A A^T for A (n x m, column-major, m contiguous columns). Double
/// accumulation: a float Gram loses 2-3 % of accuracy, and squaring costs half the digits. Dispatched at run
/// time to the widest vectors.
void addGram(const Eigen::Ref<const Eigen::MatrixXf>& A, Eigen::MatrixXd& gram);
/// The same with vectors of a given width.
void addGram(const Eigen::Ref<const Eigen::MatrixXf>& A, Eigen::MatrixXd& gram, int vector_bytes);

/// Widths of the vectors [bytes] that this CPU can run, widest first.
std::vector<int> gramVectorBytes();

}  // namespace ttsdf
