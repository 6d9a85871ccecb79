#include "gram.h"

#include <algorithm>
#include <cstring>
#include <vector>

namespace ttsdf {

namespace {

constexpr int kTile = 8;  // rows of a tile; the panels are packed in groups of kTile

/// tile (kTile x kTile, row-major) = sum over m of a[m][:] b[m][:]^T, both packed as m groups of kTile
/// doubles.
using TileKernel = void (*)(const double* a, const double* b, int m, double* tile);

/// Explicit vectors of kBytes and eight accumulators at every width: left to itself GCC turns the plain loops
/// into permutations, or keeps the tile in memory.
template <int kBytes>
[[gnu::always_inline]] inline void multiplyTile(const double* a, const double* b, int m, double* tile) {
  typedef double Vector __attribute__((vector_size(kBytes)));
  constexpr int kLanes = kBytes / static_cast<int>(sizeof(double)), kVectors = kTile / kLanes;
  for (int p0 = 0; p0 < kTile; p0 += kLanes) {
    Vector acc[kLanes][kVectors] = {};
    for (int t = 0; t < m; ++t) {
      Vector row[kVectors];  // by memcpy: GCC 10 forgets the alignment of a vector type that depends on a
                             // parameter
      std::memcpy(row, b + t * kTile, sizeof(row));
      for (int p = 0; p < kLanes; ++p) {
        for (int v = 0; v < kVectors; ++v) acc[p][v] += a[t * kTile + p0 + p] * row[v];
      }
    }
    for (int p = 0; p < kLanes; ++p) {
      std::memcpy(tile + (p0 + p) * kTile, acc[p], sizeof(acc[p]));
    }
  }
}

void multiplyTile16(const double* a, const double* b, int m, double* tile) {
  multiplyTile<16>(a, b, m, tile);
}

#if defined(__x86_64__)
[[gnu::target("avx2,fma")]] void multiplyTile32(const double* a, const double* b, int m, double* tile) {
  multiplyTile<32>(a, b, m, tile);
}
[[gnu::target("avx512f")]] void multiplyTile64(const double* a, const double* b, int m, double* tile) {
  multiplyTile<64>(a, b, m, tile);
}
#endif

TileKernel tileKernel([[maybe_unused]] int vector_bytes) {
#if defined(__x86_64__)
  if (vector_bytes == 64) return multiplyTile64;
  if (vector_bytes == 32) return multiplyTile32;
#endif
  return multiplyTile16;
}

}  // namespace

std::vector<int> gramVectorBytes() {
  std::vector<int> widths;
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f")) widths.push_back(64);
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) widths.push_back(32);
#endif
  widths.push_back(16);
  return widths;
}

void addGram(const Eigen::Ref<const Eigen::MatrixXf>& A, Eigen::MatrixXd& gram) {
  static const int widest = gramVectorBytes().front();
  addGram(A, gram, widest);
}

void addGram(const Eigen::Ref<const Eigen::MatrixXf>& A, Eigen::MatrixXd& gram, int vector_bytes) {
  constexpr int kPanel = 256;  // columns at a time: a group of packed rows stays in the first-level cache
  const TileKernel multiply = tileKernel(vector_bytes);
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
        multiply(&packed[static_cast<std::size_t>(g) * kPanel * kTile],
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
