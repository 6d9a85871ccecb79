#include "gram.h"

#include <algorithm>
#include <vector>

#include "vectorize.h"

namespace ttsdf {

namespace {

constexpr int kTile = 8;  // rows of a register tile; the panels are packed in groups of kTile

/// tile (kTile x kTile, row-major) += sum over m of a[m][:] b[m][:]^T, both packed as m groups of kTile
/// doubles.
TTSDF_VECTORIZE void accumulateTile(const double* __restrict a, const double* __restrict b, int m,
                                    double* __restrict tile) {
  double acc[kTile][kTile] = {};
  for (int t = 0; t < m; ++t) {
    for (int p = 0; p < kTile; ++p) {
      for (int q = 0; q < kTile; ++q) acc[p][q] += a[t * kTile + p] * b[t * kTile + q];
    }
  }
  for (int p = 0; p < kTile; ++p) {
    for (int q = 0; q < kTile; ++q) tile[p * kTile + q] += acc[p][q];
  }
}

}  // namespace

void addGram(const Eigen::Ref<const Eigen::MatrixXf>& A, Eigen::MatrixXd& gram) {
  constexpr int kPanel = 256;  // columns at a time: a group of packed rows stays in the first-level cache
  const int n = static_cast<int>(A.rows());
  const int groups = (n + kTile - 1) / kTile;
  std::vector<double> packed(static_cast<std::size_t>(groups) * kTile * kPanel);
  double tile[kTile * kTile];
  for (Eigen::Index begin = 0; begin < A.cols(); begin += kPanel) {
    const int m = static_cast<int>(std::min<Eigen::Index>(kPanel, A.cols() - begin));
    std::fill(packed.begin(), packed.end(), 0.0);
    for (int t = 0; t < m; ++t) {
      const float* column = A.data() + (begin + t) * A.outerStride();
      for (int i = 0; i < n; ++i) {
        packed[(static_cast<std::size_t>(i / kTile) * kPanel + static_cast<std::size_t>(t)) * kTile +
               static_cast<std::size_t>(i % kTile)] = column[i];
      }
    }
    for (int g = 0; g < groups; ++g) {
      for (int h = 0; h <= g; ++h) {
        std::fill(tile, tile + kTile * kTile, 0.0);
        accumulateTile(&packed[static_cast<std::size_t>(g) * kPanel * kTile],
                       &packed[static_cast<std::size_t>(h) * kPanel * kTile], m, tile);
        const int rows = std::min(kTile, n - g * kTile), cols = std::min(kTile, n - h * kTile);
        for (int q = 0; q < cols; ++q) {
          for (int p = 0; p < rows; ++p) gram(g * kTile + p, h * kTile + q) += tile[p * kTile + q];
        }
      }
    }
  }
}

}  // namespace ttsdf
