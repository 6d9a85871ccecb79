#include "gemm.h"

#include <algorithm>
#include <vector>

#include "vectorize.h"

namespace ttsdf {

namespace {

constexpr int kRows = 32;  // register tile: kRows x kCols accumulators
constexpr int kCols = 4;

/// kCols columns of kRows = packed A panel (depth x kRows, row-fastest) times kCols columns of B.
TTSDF_VECTORIZE void multiplyTile(const float* __restrict a, const float* const b[kCols], int depth,
                                  float* const result[kCols]) {
  float acc[kCols][kRows] = {};
  for (int k = 0; k < depth; ++k) {
    for (int c = 0; c < kCols; ++c) {
      const float weight = b[c][k];
      for (int r = 0; r < kRows; ++r) acc[c][r] += weight * a[k * kRows + r];
    }
  }
  for (int c = 0; c < kCols; ++c) {
    float* __restrict const column = result[c];
    for (int r = 0; r < kRows; ++r) column[r] = acc[c][r];
  }
}

}  // namespace

void gemm(const Eigen::Ref<const Eigen::MatrixXf>& A, const Eigen::Ref<const Eigen::MatrixXf>& B,
          Eigen::Ref<Eigen::MatrixXf> C) {
  const int m = static_cast<int>(A.rows()), depth = static_cast<int>(A.cols()),
            n = static_cast<int>(B.cols());
  static thread_local std::vector<float> panel;
  panel.resize(static_cast<std::size_t>(kRows) * static_cast<std::size_t>(depth));
  alignas(64) float tile[kCols * kRows];
  for (int row = 0; row < m; row += kRows) {
    const int rows = std::min(kRows, m - row);
    for (int k = 0; k < depth; ++k) {
      const float* const source = A.data() + k * A.outerStride() + row;
      float* const target = &panel[static_cast<std::size_t>(k) * kRows];
      if (rows == kRows) {
        std::copy_n(source, kRows, target);
        continue;
      }
      std::copy_n(source, rows, target);
      std::fill(target + rows, target + kRows, 0.0f);
    }
    for (int column = 0; column < n; column += kCols) {
      const int columns = std::min(kCols, n - column);
      const bool whole = rows == kRows && columns == kCols;
      const float* b[kCols];
      float* result[kCols];
      for (int c = 0; c < kCols; ++c) {
        b[c] = B.data() + (column + std::min(c, columns - 1)) * B.outerStride();
        result[c] = whole ? C.data() + (column + c) * C.outerStride() + row : tile + c * kRows;
      }
      multiplyTile(panel.data(), b, depth, result);
      for (int c = 0; !whole && c < columns; ++c)
        std::copy_n(tile + c * kRows, rows, C.data() + (column + c) * C.outerStride() + row);
    }
  }
}

}  // namespace ttsdf
