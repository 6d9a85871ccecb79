#include "hole_filling.h"

#include <algorithm>
#include <array>
#include <utility>

#include "../build_steps/parallel.h"

namespace ttsdf {
namespace {

constexpr int kSweeps = 6;  // per level

struct Level {
  DenseTensor values;
  std::vector<std::uint8_t> loose;
};

template <class Function>
void forEachRow(const Dims& dims, int threads, const Function& fn) {
  parallelFor(dims[2], threads, [&](int k) {
    for (int j = 0; j < dims[1]; ++j) fn(j, k);
  });
}

/// Mean of the eight (at the far borders fewer) samples below, of those that are not loose; loose if all are.
Level coarser(const Level& fine, int threads) {
  const Dims& from = fine.values.dims();
  const Dims dims = (from + 1) / 2;
  Level coarse{DenseTensor(dims), std::vector<std::uint8_t>(static_cast<std::size_t>(dims.prod()), 1)};
  forEachRow(dims, threads, [&](int j, int k) {
    for (int i = 0; i < dims[0]; ++i) {
      float sum = 0.0F;
      int count = 0;
      for (int c = 2 * k; c < std::min(2 * k + 2, from[2]); ++c) {
        for (int b = 2 * j; b < std::min(2 * j + 2, from[1]); ++b) {
          for (int a = 2 * i; a < std::min(2 * i + 2, from[0]); ++a) {
            const std::size_t n = fine.values.offset(a, b, c);
            if (!fine.loose[n]) sum += fine.values.data()[n], ++count;
          }
        }
      }
      if (count == 0) continue;
      const std::size_t n = coarse.values.offset(i, j, k);
      coarse.values.data()[n] = sum / static_cast<float>(count);
      coarse.loose[n] = 0;
    }
  });
  return coarse;
}

/// Neighbouring coarse samples of a fine index and the share of the first: a coarse sample sits between two
/// fine ones.
struct HoleSpan {
  int low, high;
  float share_high;
};
HoleSpan coarseSpan(int index, int coarse_size) {
  const int base = index / 2;
  return index % 2 == 0 ? HoleSpan{std::max(base - 1, 0), base, 0.75F}
                        : HoleSpan{base, std::min(base + 1, coarse_size - 1), 0.25F};
}

/// Trilinear values of the coarser level for the loose samples.
void interpolate(const Level& coarse, Level& fine, int threads) {
  const Dims& dims = fine.values.dims();
  const Dims& from = coarse.values.dims();
  forEachRow(dims, threads, [&](int j, int k) {
    const HoleSpan y = coarseSpan(j, from[1]), z = coarseSpan(k, from[2]);
    for (int i = 0; i < dims[0]; ++i) {
      const std::size_t n = fine.values.offset(i, j, k);
      if (!fine.loose[n]) continue;
      const HoleSpan x = coarseSpan(i, from[0]);
      const auto along_x = [&](int b, int c) {
        return (1.0F - x.share_high) * coarse.values(x.low, b, c) +
               x.share_high * coarse.values(x.high, b, c);
      };
      const auto along_xy = [&](int c) {
        return (1.0F - y.share_high) * along_x(y.low, c) + y.share_high * along_x(y.high, c);
      };
      fine.values.data()[n] = (1.0F - z.share_high) * along_xy(z.low) + z.share_high * along_xy(z.high);
    }
  });
}

/// Mean of the neighbours, for red and black samples in turn: the result does not depend on the threads.
void relax(Level& level, int threads) {
  const Dims& dims = level.values.dims();
  const std::array<std::size_t, 3> stride{1, level.values.offset(0, 1, 0), level.values.offset(0, 0, 1)};
  float* values = level.values.data();
  for (int half_sweep = 0; half_sweep < 2 * kSweeps; ++half_sweep) {
    forEachRow(dims, threads, [&](int j, int k) {
      for (int i = (j + k + half_sweep) & 1; i < dims[0]; i += 2) {
        const std::size_t n = level.values.offset(i, j, k);
        if (!level.loose[n]) continue;
        const std::array<int, 3> at{i, j, k};
        float sum = 0.0F;
        int count = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          if (at[axis] > 0) sum += values[n - stride[axis]], ++count;
          if (at[axis] + 1 < dims[static_cast<int>(axis)]) sum += values[n + stride[axis]], ++count;
        }
        if (count > 0) values[n] = sum / static_cast<float>(count);
      }
    });
  }
}

void fill(Level& level, int threads) {
  const auto holes = std::count(level.loose.begin(), level.loose.end(), 1);
  if (holes == 0 || holes == static_cast<std::ptrdiff_t>(level.loose.size())) return;
  Level coarse = coarser(level, threads);
  fill(coarse, threads);
  interpolate(coarse, level, threads);
  relax(level, threads);
}

}  // namespace

void fillHoles(DenseTensor& values, const std::vector<std::uint8_t>& loose, int threads) {
  Level level{std::move(values), loose};
  fill(level, threads);
  values = std::move(level.values);
}

}  // namespace ttsdf
