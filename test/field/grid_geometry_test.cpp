#include "ttsdf_localization/field/grid_geometry.h"

#include <gtest/gtest.h>

#include <limits>

namespace ttsdf {
namespace {

GridGeometry sample() {
  GridGeometry geometry;
  geometry.dims = Dims(11, 21, 31);
  geometry.voxel_size = 0.5;
  geometry.T_map_grid =
      Eigen::Translation3d(10.0, 20.0, 30.0) * Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ());
  return geometry;
}

TEST(GridGeometry, ASampleSitsAtItsIntegerIndex) {
  const GridGeometry geometry = sample();
  // Index 0 is at the origin of the grid frame itself: no half voxel.
  EXPECT_TRUE(
      geometry.samplePosition(Eigen::Vector3d::Zero()).isApprox(Eigen::Vector3d(10.0, 20.0, 30.0), 1e-12));
  // A quarter turn puts the grid's x on the map's y and its y on the map's -x.
  EXPECT_TRUE(geometry.samplePosition(Eigen::Vector3d(2.0, 4.0, 6.0))
                  .isApprox(Eigen::Vector3d(8.0, 21.0, 33.0), 1e-12));
}

TEST(GridGeometry, IndexAndPositionAreInverse) {
  const GridGeometry geometry = sample();
  for (const Eigen::Vector3d& index : {Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(3.25, -7.5, 100.0)}) {
    EXPECT_LT((geometry.toIndex(geometry.samplePosition(index)) - index).norm(), 1e-10);
  }
}

TEST(GridGeometry, ContainsItsSamplesAndWhatLiesBetweenThem) {
  const GridGeometry geometry = sample();
  EXPECT_TRUE(geometry.containsIndex(Eigen::Vector3d(0.0, 0.0, 0.0)));
  EXPECT_TRUE(geometry.containsIndex(Eigen::Vector3d(10.0, 20.0, 30.0)));
  EXPECT_FALSE(geometry.containsIndex(Eigen::Vector3d(-0.01, 5.0, 5.0)));
  EXPECT_FALSE(geometry.containsIndex(Eigen::Vector3d(5.0, 5.0, 30.01)));
  EXPECT_FALSE(geometry.containsIndex(Eigen::Vector3d(5.0, std::nan(""), 5.0)));
  EXPECT_EQ(geometry.voxelCount(), 11u * 21u * 31u);
}

TEST(GridGeometry, CheckRefusesWhatIsNoGrid) {
  EXPECT_NO_THROW(check(sample()));
  const auto refused = [](auto change) {
    GridGeometry geometry = sample();
    change(geometry);
    EXPECT_THROW(check(geometry), std::invalid_argument);
  };
  refused([](GridGeometry& g) { g.dims[1] = 0; });
  refused([](GridGeometry& g) { g.dims[2] = -3; });
  refused([](GridGeometry& g) { g.voxel_size = 0.0; });
  refused([](GridGeometry& g) { g.voxel_size = -0.02; });
  refused([](GridGeometry& g) { g.voxel_size = std::nan(""); });
  refused([](GridGeometry& g) { g.voxel_size = std::numeric_limits<double>::infinity(); });
  refused([](GridGeometry& g) { g.T_map_grid.linear() *= 1.01; });
  refused([](GridGeometry& g) { g.T_map_grid.linear().col(0) *= -1.0; });
  refused([](GridGeometry& g) { g.T_map_grid.translation().x() = std::nan(""); });
}

}  // namespace
}  // namespace ttsdf
