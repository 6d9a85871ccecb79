#include "ttsdf_localization/surface/observed_sides.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace ttsdf {
namespace {

constexpr double kVoxel = 0.05;

/// Every sample something else.
ObservedGrid mixed() {
  ObservedGrid grid;
  grid.dims = {14, 11, 9};
  grid.origin = {-6, 3, -2};
  grid.voxel_size = kVoxel;
  grid.truncation = 0.15;
  std::mt19937 random(3);
  for (int n = 0; n < grid.dims.prod(); ++n) {
    grid.state.push_back(static_cast<Observation>(random() % 4));
    grid.tsdf.push_back(random() % 2 == 0 ? -0.01F : 0.01F);
  }
  return grid;
}

Side sideOf(const ObservedGrid& grid, std::size_t n) {
  if (grid.state[n] == Observation::kUnknown) return Side::kUnknown;
  if (grid.state[n] == Observation::kFree) return Side::kFree;
  if (grid.state[n] == Observation::kInterior) return Side::kMatter;
  return grid.tsdf[n] < 0.0F ? Side::kMatter : Side::kFree;
}

/// Compares with the observed sample that is nearest in the map frame; counts the exact ones.
int expectNearest(const ObservedGrid& observed, const GridGeometry& geometry) {
  const std::vector<SideReading> sides = readSides(observed, geometry, 2);
  EXPECT_EQ(sides.size(), geometry.voxelCount());
  int exact = 0;
  std::size_t n = 0;
  for (int k = 0; k < geometry.dims[2]; ++k) {
    for (int j = 0; j < geometry.dims[1]; ++j) {
      for (int i = 0; i < geometry.dims[0]; ++i, ++n) {
        const Eigen::Vector3d p = geometry.samplePosition(Eigen::Vector3d(i, j, k));
        Eigen::Array3i nearest;
        for (int axis = 0; axis < 3; ++axis)
          nearest[axis] = static_cast<int>(std::lround(p[axis] / kVoxel)) - observed.origin[axis];
        const bool inside = (nearest >= 0).all() && (nearest < observed.dims).all();
        const Side side =
            inside ? sideOf(observed, observed.offset(nearest[0], nearest[1], nearest[2])) : Side::kUnknown;
        EXPECT_EQ(sides[n].side, side) << i << ' ' << j << ' ' << k;
        const Eigen::Vector3d sample = kVoxel * (nearest + observed.origin).cast<double>().matrix();
        if (inside) {
          EXPECT_EQ(sides[n].exact, (p - sample).cwiseAbs().maxCoeff() < 1e-5) << i << ' ' << j << ' ' << k;
        }
        exact += sides[n].exact ? 1 : 0;
      }
    }
  }
  return exact;
}

GridGeometry around(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& corner) {
  GridGeometry geometry;
  geometry.dims = {18, 16, 13};
  geometry.voxel_size = kVoxel;
  geometry.T_map_grid.linear() = rotation;
  geometry.T_map_grid.translation() = kVoxel * corner;
  return geometry;
}

TEST(ObservedSides, AreThoseOfTheSamplesOnAGridInStep) {
  // Two samples stand out on every side.
  EXPECT_EQ(expectNearest(mixed(), around(Eigen::Matrix3d::Identity(), {-8.0, 1.0, -4.0})), 14 * 11 * 9);
}

TEST(ObservedSides, AreThoseOfTheNearestSamples) {
  EXPECT_EQ(expectNearest(mixed(), around(Eigen::Matrix3d::Identity(), {-7.7, 0.6, -4.2})), 0);
  const Eigen::Matrix3d turned = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
  EXPECT_EQ(expectNearest(mixed(), around(turned, {-7.73, 0.61, -4.17})), 0);
  const Eigen::Matrix3d quarter = Eigen::AngleAxisd(std::acos(0.0), Eigen::Vector3d::UnitZ()).matrix();
  EXPECT_GT(expectNearest(mixed(), around(quarter, {9.0, 1.0, -4.0})), 500);
}

}  // namespace
}  // namespace ttsdf
