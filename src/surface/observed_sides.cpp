#include "ttsdf_localization/surface/observed_sides.h"

#include <algorithm>
#include <cmath>

#include "../build_steps/parallel.h"

namespace ttsdf {
namespace {

constexpr double kOnSample = 1e-4;  // [voxel]

Side sideOf(Observation state, float tsdf) {
  switch (state) {
    case Observation::kFree:
      return Side::kFree;
    case Observation::kInterior:
      return Side::kMatter;
    case Observation::kBand:
      return tsdf < 0.0F ? Side::kMatter : Side::kFree;
    case Observation::kUnknown:
      break;
  }
  return Side::kUnknown;
}

/// Nearest integer; std::floor is a call on processors that the program must run on.
int rounded(double value) {
  constexpr int kPositive = 1 << 20;  // beyond every grid
  return static_cast<int>(value + (kPositive + 0.5)) - kPositive;
}

class Reader {
 public:
  Reader(const ObservedGrid& observed, const GridGeometry& geometry)
      : observed_(observed), dims_(geometry.dims), axes_(geometry.T_map_grid.linear()) {
    // Index of the sampled grid -> index of the observed grid.
    first_ =
        geometry.T_map_grid.translation() / geometry.voxel_size - observed.origin.cast<double>().matrix();
    const double turned = (axes_ - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    straight_ = turned * dims_.maxCoeff() < 0.1 * kOnSample;
  }

  void readRow(int j, int k, SideReading* row) const {
    const Eigen::Vector3d start = first_ + axes_ * Eigen::Vector3d(0, j, k);
    if (straight_) {
      readStraight(start, row);
    } else {
      readTurned(start, row);
    }
  }

 private:
  /// The row runs along a row of the observed grid.
  void readStraight(const Eigen::Vector3d& start, SideReading* row) const {
    const Eigen::Array3i nearest(rounded(start[0]), rounded(start[1]), rounded(start[2]));
    const bool exact = (start.array() - nearest.cast<double>()).abs().maxCoeff() < kOnSample;
    const Dims& dims = observed_.dims;
    std::fill_n(row, dims_[0], SideReading());
    if ((nearest < 0).tail<2>().any() || (nearest >= dims).tail<2>().any()) return;
    const int begin = std::max(0, -nearest[0]), end = std::min(dims_[0], dims[0] - nearest[0]);
    if (begin >= end) return;
    std::size_t n = observed_.offset(nearest[0] + begin, nearest[1], nearest[2]);
    for (int i = begin; i < end; ++i, ++n) row[i] = {sideOf(observed_.state[n], observed_.tsdf[n]), exact};
  }

  void readTurned(const Eigen::Vector3d& start, SideReading* row) const {
    const Dims& dims = observed_.dims;
    const auto outside = [](int index, int size) {
      return static_cast<unsigned>(index) >= static_cast<unsigned>(size);
    };
    const auto off = [](double place, int index) { return std::abs(place - index); };
    for (int i = 0; i < dims_[0]; ++i) {
      const double x = start[0] + i * axes_(0, 0), y = start[1] + i * axes_(1, 0),
                   z = start[2] + i * axes_(2, 0);
      const int a = rounded(x), b = rounded(y), c = rounded(z);
      row[i] = SideReading();
      if (outside(a, dims[0]) || outside(b, dims[1]) || outside(c, dims[2])) continue;
      const std::size_t n = observed_.offset(a, b, c);
      const bool exact = off(x, a) < kOnSample && off(y, b) < kOnSample && off(z, c) < kOnSample;
      row[i] = {sideOf(observed_.state[n], observed_.tsdf[n]), exact};
    }
  }

  const ObservedGrid& observed_;
  Dims dims_;
  Eigen::Matrix3d axes_;
  Eigen::Vector3d first_;
  bool straight_ = false;
};

}  // namespace

std::vector<SideReading> readSides(const ObservedGrid& observed, const GridGeometry& geometry, int threads) {
  const Dims& dims = geometry.dims;
  std::vector<SideReading> sides(geometry.voxelCount());
  const Reader reader(observed, geometry);
  parallelFor(dims[2], threads, [&](int k) {
    for (int j = 0; j < dims[1]; ++j) {
      const auto row =
          static_cast<std::size_t>(j) + static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(k);
      reader.readRow(j, k, sides.data() + row * static_cast<std::size_t>(dims[0]));
    }
  });
  return sides;
}

}  // namespace ttsdf
