#pragma once
// Single-precision matrix product, compiled for several vector widths and chosen at load time. Eigen's own
// product only uses the instructions that the whole program is compiled for.

#include <Eigen/Core>

namespace ttsdf {

/// C = A B (column-major). C must have the right size; A and B may be blocks.
void gemm(const Eigen::Ref<const Eigen::MatrixXf>& A, const Eigen::Ref<const Eigen::MatrixXf>& B,
          Eigen::Ref<Eigen::MatrixXf> C);

}  // namespace ttsdf
