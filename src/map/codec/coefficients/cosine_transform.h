#pragma once
// Orthonormal discrete cosine transform (DCT-II) of one mode: the slices of a field vary smoothly from one to
// the next, so their transform has few large coefficients, and an orthonormal transform leaves every error as
// it is.

#include <Eigen/Core>

namespace ttsdf {

/// Modes longer than this are not transformed: the matrix would outgrow the map.
constexpr int kMaxTransformLength = 2048;

/// Row f = cosine of frequency f, n x n.
Eigen::MatrixXf cosineMatrix(int n);

/// For many transforms of one length.
class CosineTransform {
 public:
  explicit CosineTransform(int n);
  /// matrix (rows x n): every row to its n cosine coefficients and back; unchanged if n >
  /// kMaxTransformLength.
  Eigen::MatrixXf toFrequencies(const Eigen::MatrixXf& matrix, int threads) const;
  Eigen::MatrixXf fromFrequencies(const Eigen::MatrixXf& matrix, int threads) const;

 private:
  Eigen::MatrixXf to_, from_;  // empty: nothing is transformed
};

/// matrix (rows x n): every row to its n cosine coefficients and back; unchanged if n > kMaxTransformLength.
Eigen::MatrixXf rowsToFrequencies(const Eigen::MatrixXf& matrix);
Eigen::MatrixXf rowsFromFrequencies(const Eigen::MatrixXf& matrix);

}  // namespace ttsdf
