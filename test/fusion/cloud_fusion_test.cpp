// Fusion of clouds ray by ray.

#include <gtest/gtest.h>

#include <cmath>

#include "../support/rendered_scene.h"
#include "../support/volume_probe.h"
#include "ttsdf_localization/frames/pinhole.h"

namespace ttsdf {
namespace {

using testing::camera;
using testing::lookAt;
using testing::render;
using testing::Scene;
using testing::worldPosition;
using testing::zeroCrossings;

Eigen::Matrix3Xf cloudOf(const Scene& scene, const Eigen::Isometry3d& pose) {
  return toPoints(render(scene, camera(), pose), camera(), 1, 0.0, 100.0);
}

TEST(CloudFusion, FindsPlaneWhereItIs) {
  const Scene scene = Scene().plane({0.1, 0.2, 1.0}, 0.0137);
  TsdfVolume volume;
  for (const Eigen::Vector3d& eye : {Eigen::Vector3d(0.1, 0.0, 1.4), Eigen::Vector3d(0.4, 0.5, 1.3)}) {
    const auto pose = lookAt(eye, {0.0, 0.1, 0.0});
    volume.integrate(cloudOf(scene, pose), pose);
  }
  std::vector<double> errors;
  double mean = 0.0;
  for (const auto& point : zeroCrossings(volume)) errors.push_back(scene.distance(point) / 0.02);
  ASSERT_GT(errors.size(), 3000U);
  for (const double error : errors) mean += error / static_cast<double>(errors.size());
  EXPECT_LE(std::abs(mean), 0.05);  // half a voxel if cells were taken for samples
  EXPECT_LE(testing::rms(errors), 0.15);
  EXPECT_EQ(volume.frameCount(), 2U);
}

TEST(CloudFusion, TellsFreeFromUnknown) {
  const Scene scene = Scene().plane({0, 0, -1}, -2.0);
  const auto pose = Eigen::Isometry3d::Identity();
  TsdfVolume volume;
  volume.integrate(cloudOf(scene, pose), pose);
  const VoxelReader reader(volume.grids());
  for (int z = 5; z <= 95; ++z) EXPECT_EQ(reader.state({0, 0, z}), VoxelState::kFree) << z;
  EXPECT_EQ(reader.state({0, 0, 99}), VoxelState::kBand);
  EXPECT_EQ(reader.state({0, 0, 101}), VoxelState::kBand);
  EXPECT_LT(reader.distance({0, 0, 101}), 0.0F);
  for (int z = 105; z <= 140; ++z) EXPECT_EQ(reader.state({0, 0, z}), VoxelState::kUnknown) << z;
  EXPECT_EQ(reader.state({0, 0, -5}), VoxelState::kUnknown);
}

TEST(CloudFusion, SkipsPointsThatAreNotFiniteOrOutOfRange) {
  const Scene scene = Scene().room({0, 0, 0}, {3, 3, 2.5});
  const auto pose = lookAt({2, 2, 1}, {0.2, 0.1, 0.9});
  const Eigen::Matrix3Xf good = cloudOf(scene, pose);
  const Eigen::Vector3f bad_points[] = {{NAN, 0.0F, 1.0F},    {0.0F, INFINITY, 1.0F}, {0.0F, 0.0F, -INFINITY},
                                        {1e9F, 1e9F, 1e9F},   {0.0F, 0.0F, 0.0F},     {0.0F, 0.05F, 0.0F},
                                        {3e38F, 3e38F, 0.0F}, {NAN, NAN, NAN},        {0.0F, 0.0F, 4.5F}};
  Eigen::Matrix3Xf mixed(3, good.cols() + 9);
  mixed.leftCols(good.cols()) = good;
  for (Eigen::Index i = 0; i < 9; ++i) mixed.col(good.cols() + i) = bad_points[i];
  TsdfVolume expected, volume, nothing;
  expected.integrate(good, pose);
  volume.integrate(mixed, pose);
  EXPECT_FALSE(expected.empty());
  EXPECT_TRUE(testing::sameVolumes(expected, volume));
  nothing.integrate(Eigen::Matrix3Xf(mixed.rightCols(9)), pose);
  nothing.integrate(Eigen::Matrix3Xf(3, 0), pose);
  EXPECT_TRUE(nothing.empty());
  Eigen::Isometry3d broken = pose;
  broken.translation().y() = INFINITY;
  EXPECT_THROW(nothing.integrate(good, broken), std::invalid_argument);
}

TEST(CloudFusion, DoesNotDependOnTheNumberOfThreads) {
  const Scene scene = Scene().room({0, 0, 0}, {3, 3, 2.5}).sphere({1.0, 0.8, 0.5}, 0.3);
  std::vector<TsdfVolume> volumes;
  for (const int threads : {1, 2}) {
    FusionOptions options;
    options.threads = threads;
    TsdfVolume volume(options);
    for (const Eigen::Vector3d& eye : {Eigen::Vector3d(2, 2, 1), Eigen::Vector3d(2.2, 1.9, 1.4)}) {
      const auto pose = lookAt(eye, {1.0, 0.8, 0.5});
      volume.integrate(cloudOf(scene, pose), pose);
    }
    volumes.push_back(std::move(volume));
  }
  EXPECT_FALSE(volumes[0].empty());
  EXPECT_TRUE(testing::sameVolumes(volumes[0], volumes[1]));
}

TEST(CloudFusion, OrganisedCloudGivesTheDepthImagesVolume) {
  // The live path: depth image -> cloud (single precision) -> pinholeFromCloud -> the volume of the image
  // itself.
  const Scene scene = Scene().room({0, 0, 0}, {3, 3, 2.5}).box({1.0, 0.8, 0.0}, {1.4, 1.2, 1.1});
  const auto pose = lookAt({2.3, 2.1, 1.3}, {0.9, 0.7, 0.8});
  const CameraIntrinsics k = camera();
  const DepthImage image = render(scene, k, pose);
  Eigen::Matrix3Xf cloud(3, static_cast<Eigen::Index>(image.depth.size()));
  for (Eigen::Index i = 0; i < cloud.cols(); ++i) {
    const float depth = image.depth[static_cast<std::size_t>(i)];
    const Eigen::Vector3d ray =
        testing::pixelRay(k, static_cast<double>(i % k.width), static_cast<double>(i / k.width));
    cloud.col(i) = ray.cast<float>() * depth;
  }
  const auto pinhole = pinholeFromCloud(cloud, k.width, k.height);
  ASSERT_TRUE(pinhole);
  TsdfVolume live, folder;
  live.integrate(pinhole->first, pinhole->second, pose);
  folder.integrate(image, k, pose);
  // The fitted intrinsics differ in the last digits: voxels on the very border of two pixels may fall to the
  // other.
  const auto band = static_cast<double>(folder.grids().tsdf->activeVoxelCount());
  ASSERT_GT(band, 10000.0);
  std::size_t same = 0;
  const auto accessor = live.grids().tsdf->getConstAccessor();
  for (auto voxel = folder.grids().tsdf->cbeginValueOn(); voxel; ++voxel) {
    float value = 0.0F;
    same += accessor.probeValue(voxel.getCoord(), value) && std::abs(value - *voxel) < 1e-4F;
  }
  EXPECT_GE(static_cast<double>(same), 0.999 * band);
}

}  // namespace
}  // namespace ttsdf
