// What moved goes away; what stands stays where it is.

#include <gtest/gtest.h>

#include <random>

#include "../support/rendered_scene.h"
#include "../support/volume_probe.h"

namespace ttsdf {
namespace {

using testing::camera;
using testing::lookAt;
using testing::render;
using testing::Scene;
using testing::worldPosition;
using testing::zeroCrossings;

const Eigen::Vector3d kBoxLow(1.0, 1.0, 0.0), kBoxHigh(1.4, 1.5, 0.7);

Scene emptyRoom() { return Scene().room({0.013, 0.007, 0.003}, {3.011, 2.513, 2.209}); }
Scene furnishedRoom() { return emptyRoom().box(kBoxLow, kBoxHigh); }

std::vector<Eigen::Isometry3d> viewsAround(unsigned seed, int count) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<Eigen::Isometry3d> views;
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * M_PI * (i + unit(random)) / count;
    const Eigen::Vector3d eye(1.4 + 1.1 * std::cos(angle), 1.25 + 1.0 * std::sin(angle),
                              0.9 + 0.8 * unit(random));
    views.push_back(lookAt(eye, {1.1 + 0.4 * unit(random), 1.1 + 0.3 * unit(random), 0.3}));
  }
  return views;
}

void fuse(const Scene& scene, const std::vector<Eigen::Isometry3d>& views, TsdfVolume& volume) {
  for (const auto& view : views) volume.integrate(render(scene, camera(), view), camera(), view);
}

bool nearBox(const Eigen::Vector3d& p, double margin) {
  return ((p - kBoxLow).array() > -margin).all() && ((kBoxHigh - p).array() > -margin).all();
}

TEST(Carving, RemovesAnObjectThatWentAway) {
  TsdfVolume volume;
  fuse(furnishedRoom(), viewsAround(1, 8), volume);
  const auto crossingsAtBox = [&volume] {
    int count = 0;
    for (const auto& point : zeroCrossings(volume)) count += point.z() > 0.1 && nearBox(point, 0.05);
    return count;
  };
  ASSERT_GT(crossingsAtBox(), 1000);

  fuse(emptyRoom(), viewsAround(2, 40), volume);
  EXPECT_EQ(crossingsAtBox(), 0);
  // Where it stood is free; not one voxel of its band is left.
  const VoxelReader reader(volume.grids());
  for (int x = 48; x <= 72; ++x) {
    for (int y = 48; y <= 77; ++y) {
      for (int z = 6; z <= 38; ++z)
        ASSERT_EQ(reader.state({x, y, z}), VoxelState::kFree) << openvdb::Coord(x, y, z);
    }
  }
}

TEST(Carving, IsOffByOption) {
  FusionOptions options;
  options.carve = false;
  TsdfVolume volume(options);
  fuse(furnishedRoom(), viewsAround(1, 4), volume);
  const std::size_t before = zeroCrossings(volume).size();
  fuse(emptyRoom(), viewsAround(2, 20), volume);
  EXPECT_EQ(volume.grids().free->activeVoxelCount(), 0U);
  EXPECT_GE(zeroCrossings(volume).size(), before);
}

TEST(Carving, LeavesStandingSurfacesWhereTheyAre) {
  // Many rays pass the box closely on their way to walls and floor; its surface must not move.
  const auto views = viewsAround(3, 40);
  FusionOptions options;
  TsdfVolume carved(options);
  options.carve = false;
  TsdfVolume plain(options);
  fuse(furnishedRoom(), views, carved);
  fuse(furnishedRoom(), views, plain);
  const auto boxError = [](const TsdfVolume& volume) {
    std::vector<double> errors;
    for (const auto& point : zeroCrossings(volume)) {
      if (point.z() > 0.1 && nearBox(point, 0.02)) errors.push_back(furnishedRoom().distance(point) / 0.02);
    }
    EXPECT_GT(errors.size(), 3000U);
    return testing::rms(errors);
  };
  EXPECT_LE(boxError(carved), 0.1);
  EXPECT_LE(boxError(carved), boxError(plain) + 0.01);
}

TEST(Carving, NewObjectInFreeSpaceAppears) {
  TsdfVolume volume;
  fuse(emptyRoom(), viewsAround(2, 20), volume);
  fuse(furnishedRoom(), viewsAround(1, 8), volume);
  int on_box = 0;
  for (const auto& point : zeroCrossings(volume)) on_box += point.z() > 0.1 && nearBox(point, 0.02);
  EXPECT_GT(on_box, 1000);
}

TEST(Carving, WeightIsCapped) {
  FusionOptions options;
  options.max_weight = 3.0;
  TsdfVolume volume(options);
  const auto views = viewsAround(1, 1);
  for (int i = 0; i < 20; ++i) fuse(furnishedRoom(), views, volume);
  float greatest = 0.0F;
  for (auto voxel = volume.grids().weight->cbeginValueOn(); voxel; ++voxel)
    greatest = std::max(greatest, *voxel);
  EXPECT_EQ(greatest, 3.0F);
  EXPECT_EQ(volume.frameCount(), 20U);
}

}  // namespace
}  // namespace ttsdf
