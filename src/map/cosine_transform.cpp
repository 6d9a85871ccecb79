#include "cosine_transform.h"

#include <cmath>

#include "../tensor/gemm.h"

namespace ttsdf {

Eigen::MatrixXf cosineMatrix(int n) {
  constexpr double kPi = 3.14159265358979323846;
  Eigen::MatrixXf C(n, n);
  for (int k = 0; k < n; ++k) {
    for (int f = 0; f < n; ++f) {
      // The angle is periodic in 4 n: reduced in integers, it keeps its digits for long modes.
      const long long quarter_turns = static_cast<long long>(2 * k + 1) * f % (4LL * n);
      const double angle = kPi * static_cast<double>(quarter_turns) / (2.0 * n);
      C(f, k) = static_cast<float>(std::sqrt((f == 0 ? 1.0 : 2.0) / n) * std::cos(angle));
    }
  }
  return C;
}

Eigen::MatrixXf rowsToFrequencies(const Eigen::MatrixXf& matrix) {
  const int n = static_cast<int>(matrix.cols());
  if (n > kMaxTransformLength) return matrix;
  Eigen::MatrixXf result(matrix.rows(), n);
  gemm(matrix, cosineMatrix(n).transpose(), result);
  return result;
}

Eigen::MatrixXf rowsFromFrequencies(const Eigen::MatrixXf& matrix) {
  const int n = static_cast<int>(matrix.cols());
  if (n > kMaxTransformLength) return matrix;
  Eigen::MatrixXf result(matrix.rows(), n);
  gemm(matrix, cosineMatrix(n), result);
  return result;
}

}  // namespace ttsdf
