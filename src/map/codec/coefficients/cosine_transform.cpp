#include "cosine_transform.h"

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "../../../tensor/gemm.h"
#include "../../../tensor/slab_parts.h"

namespace ttsdf {

Eigen::MatrixXf cosineMatrix(int n) {
  constexpr double kPi = 3.14159265358979323846;
  // The angle is periodic in 4 n: reduced in integers, it keeps its digits for long modes, and few are
  // different.
  const auto angles = static_cast<std::size_t>(4 * n);
  std::vector<double> cosines(angles);
  for (std::size_t quarter_turns = 0; quarter_turns < angles; ++quarter_turns)
    cosines[quarter_turns] = std::cos(kPi * static_cast<double>(quarter_turns) / (2.0 * n));
  const double constant = std::sqrt(1.0 / n), wave = std::sqrt(2.0 / n);
  Eigen::MatrixXf C(n, n);
  for (int k = 0; k < n; ++k) {
    const auto step = static_cast<std::size_t>(2 * k + 1);  // below 4 n
    std::size_t quarter_turns = 0;
    for (int f = 0; f < n; ++f) {
      C(f, k) = static_cast<float>((f == 0 ? constant : wave) * cosines[quarter_turns]);
      quarter_turns += step;
      if (quarter_turns >= angles) quarter_turns -= angles;
    }
  }
  return C;
}

namespace {

/// matrix times `factor` by several threads; matrix itself if there is no factor.
Eigen::MatrixXf product(const Eigen::MatrixXf& matrix, const Eigen::MatrixXf& factor, int threads) {
  if (factor.size() == 0) return matrix;
  if (matrix.cols() != factor.rows()) {
    throw std::invalid_argument("cosine transform: got rows of " + std::to_string(matrix.cols()) +
                                ", wanted " + std::to_string(factor.rows()));
  }
  Eigen::MatrixXf result(matrix.rows(), factor.cols());
  overParts(static_cast<int>(matrix.rows()), threads > 1 ? kSlabParts : 1, threads,
            [&](int, int begin, int end) {
              gemm(matrix.middleRows(begin, end - begin), factor, result.middleRows(begin, end - begin));
            });
  return result;
}

}  // namespace

CosineTransform::CosineTransform(int n) {
  if (n > kMaxTransformLength) return;
  from_ = cosineMatrix(n);
  to_ = from_.transpose();
}

Eigen::MatrixXf CosineTransform::toFrequencies(const Eigen::MatrixXf& matrix, int threads) const {
  return product(matrix, to_, threads);
}

Eigen::MatrixXf CosineTransform::fromFrequencies(const Eigen::MatrixXf& matrix, int threads) const {
  return product(matrix, from_, threads);
}

Eigen::MatrixXf rowsToFrequencies(const Eigen::MatrixXf& matrix) {
  return CosineTransform(static_cast<int>(matrix.cols())).toFrequencies(matrix, 1);
}

Eigen::MatrixXf rowsFromFrequencies(const Eigen::MatrixXf& matrix) {
  return CosineTransform(static_cast<int>(matrix.cols())).fromFrequencies(matrix, 1);
}

}  // namespace ttsdf
