#include "ttsdf_localization/fusion/volume_parts.h"

#include <gtest/gtest.h>

#include "../support/rendered_scene.h"
#include "ttsdf_localization/fusion/tsdf_volume_grids.h"

namespace ttsdf {
namespace {

TsdfVolume room() {
  FusionOptions options;
  options.voxel_size = 0.05;
  options.truncation = 0.15;
  options.max_depth = 8.0;
  testing::Scene scene;
  scene.room({-2.0, -1.5, -1.0}, {2.0, 1.5, 1.4}).sphere({0.8, 0.5, 0.0}, 0.4);
  TsdfVolume volume(options);
  const auto camera = testing::camera(160, 120);
  for (int n = 0; n < 6; ++n) {
    const auto pose = testing::lookAt({-0.5, -0.5, 0.2}, {std::cos(1.05 * n), std::sin(1.05 * n), 0.0});
    volume.integrate(testing::render(scene, camera, pose), camera, pose);
  }
  return volume;
}

TEST(VolumeParts, APartHoldsWhatTheWholeHoldsThere) {
  const TsdfVolume whole = room();
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-0.5, -1.7, -1.2), Eigen::Vector3d(1.3, 0.9, 0.8));
  const TsdfVolume part = partOf(whole, box);
  VoxelReader in_whole(whole.grids()), in_part(part.grids());
  int band = 0, free = 0;
  for (int k = -30; k < 35; ++k) {
    for (int j = -40; j < 40; ++j) {
      for (int i = -50; i < 50; ++i) {
        const openvdb::Coord c(i, j, k);
        const Eigen::Vector3d p = 0.05 * Eigen::Vector3d(i, j, k);
        if ((p.array() >= box.min().array() - 1e-9).all() && (p.array() <= box.max().array() + 1e-9).all()) {
          ASSERT_EQ(in_part.state(c), in_whole.state(c)) << p.transpose();
          ASSERT_EQ(in_part.distance(c), in_whole.distance(c));
          ASSERT_EQ(in_part.weight(c), in_whole.weight(c));
          band += in_part.state(c) == VoxelState::kBand ? 1 : 0;
          free += in_part.state(c) == VoxelState::kFree ? 1 : 0;
        } else {
          ASSERT_EQ(in_part.state(c), VoxelState::kUnknown) << p.transpose();
        }
      }
    }
  }
  EXPECT_GT(band, 1000);
  EXPECT_GT(free, 1000);
  EXPECT_LE(surfaceBounds(part).max().x(), 1.3 + 1e-9);
  EXPECT_GT(surfaceBounds(whole).sizes().x(), 3.5);
}

TEST(VolumeParts, TheSumTellsContentsApart) {
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-0.5, -1.7, -1.2), Eigen::Vector3d(1.3, 0.9, 0.8));
  const TsdfVolume whole = room(), again = room();
  const std::uint64_t sum = contentSum(partOf(whole, box));
  EXPECT_EQ(contentSum(partOf(again, box)), sum);
  EXPECT_NE(contentSum(whole), sum);
  const openvdb::Coord voxel = whole.grids().tsdf->cbeginValueOn().getCoord();
  TsdfVolume nearer = room(), heavier = room(), freer = room();
  nearer.grids().tsdf->tree().setValue(voxel, 0.01F);
  heavier.grids().weight->tree().setValue(voxel, 99.0F);
  freer.grids().free->tree().setValueOn(openvdb::Coord(100, 100, 100));
  for (const TsdfVolume* other : {&nearer, &heavier, &freer})
    EXPECT_NE(contentSum(*other), contentSum(whole));
  EXPECT_EQ(contentSum(partOf(freer, box)), sum);  // that is elsewhere
}

TEST(VolumeParts, CellsCoverTheBoxAndOverlap) {
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-3.0, 2.0, 0.0), Eigen::Vector3d(9.5, 10.0, 2.5));
  const auto cells = cellsOf(box, 5.0, 1.0);
  ASSERT_EQ(cells.size(), 6u);  // 3 x 2 x 1
  Eigen::AlignedBox3d all;
  for (const VolumeCell& cell : cells) all.extend(cell.box);
  EXPECT_TRUE(all.contains(box));
  EXPECT_EQ(cells[0].name, "x0_y0_z0");
  EXPECT_NEAR(cells[0].box.max().x() - cells[1].box.min().x(), 1.0, 1e-9);
  EXPECT_THROW(cellsOf({}, 5.0, 1.0), std::invalid_argument);
  EXPECT_THROW(cellsOf(box, 5.0, 5.0), std::invalid_argument);
  EXPECT_THROW(cellsOf(box, 0.0, 0.0), std::invalid_argument);
  EXPECT_THROW(cellsOf(box, 0.01, 0.0), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
