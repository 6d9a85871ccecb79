// Fusion of rendered depth against analytic shapes.

#include <gtest/gtest.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <random>

#include "../support/rendered_scene.h"
#include "../support/volume_probe.h"

namespace ttsdf {
namespace {

using testing::camera;
using testing::lookAt;
using testing::render;
using testing::rms;
using testing::Scene;
using testing::worldPosition;
using testing::zeroCrossings;

constexpr double kBar = 0.05;  // [voxel], the error that noise-free fusion may have

std::vector<double> crossingErrors(const TsdfVolume& volume, const Scene& scene) {
  std::vector<double> errors;
  for (const auto& point : zeroCrossings(volume)) {
    errors.push_back(scene.distance(point) / volume.options().voxel_size);
  }
  return errors;
}

class ObliquePlane : public ::testing::TestWithParam<double> {};

TEST_P(ObliquePlane, CrossesZeroOnThePlane) {
  const double incidence = GetParam() * M_PI / 180.0;
  // A plane that follows no axis of the grid, seen once at the given angle to its normal.
  const Eigen::Vector3d normal = Eigen::Vector3d(0.3, -0.5, 0.8).normalized(), foot(0.217, 0.133, -0.071);
  const Eigen::Vector3d aside = normal.cross(Eigen::Vector3d::UnitX()).normalized();
  const Scene scene = Scene().plane(normal, normal.dot(foot));
  const Eigen::Vector3d eye = foot + 1.5 * (std::cos(incidence) * normal + std::sin(incidence) * aside);
  TsdfVolume volume;
  const CameraIntrinsics narrow = [] {
    CameraIntrinsics k = camera();
    k.fx = k.fy = 4.0 * k.width;  // so that every pixel has nearly this angle
    return k;
  }();
  volume.integrate(render(scene, narrow, lookAt(eye, foot)), narrow, lookAt(eye, foot));
  const std::vector<double> errors = crossingErrors(volume, scene);
  ASSERT_GT(errors.size(), 50U);
  EXPECT_LE(rms(errors), kBar);
  EXPECT_EQ(volume.frameCount(), 1U);
}

INSTANTIATE_TEST_SUITE_P(Incidence, ObliquePlane, ::testing::Values(0.0, 15.0, 30.0, 45.0, 60.0));

TEST(DepthFusion, DistancesInTheBandOfAPlaneAreExact) {
  const Scene scene = Scene().plane({0.2, 0.3, 1.0}, 0.0);
  TsdfVolume volume;
  const auto pose = lookAt({0.3, 0.4, 1.5}, {0.0, 0.0, 0.0});
  volume.integrate(render(scene, camera(), pose), camera(), pose);
  std::vector<double> errors;
  for (auto voxel = volume.grids().tsdf->cbeginValueOn(); voxel; ++voxel) {
    errors.push_back(*voxel - scene.distance(worldPosition(volume, voxel.getCoord())));
  }
  ASSERT_GT(errors.size(), 10000U);
  EXPECT_LE(rms(errors), 1e-5);
}

TEST(DepthFusion, SphereFromAllSides) {
  const Eigen::Vector3d centre(0.11, -0.23, 0.37);
  const Scene scene = Scene().sphere(centre, 0.4);
  TsdfVolume volume;
  for (const Eigen::Vector3d& side :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-1, 0, 0), Eigen::Vector3d(0, 1, 0),
        Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0, -1),
        Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(-1, -1, 1)}) {
    const auto pose = lookAt(centre + 1.5 * side.normalized(), centre);
    volume.integrate(render(scene, camera(), pose), camera(), pose);
  }
  const std::vector<double> errors = crossingErrors(volume, scene);
  ASSERT_GT(errors.size(), 5000U);
  EXPECT_LE(rms(errors), kBar);
}

TEST(DepthFusion, RoomCornerAndBoxFromManyViews) {
  const Scene scene =
      Scene().room({0.013, 0.007, 0.003}, {3.011, 2.513, 2.209}).box({0.5, 0.0, 0.0}, {1.107, 0.8, 0.509});
  TsdfVolume volume;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int view = 0; view < 40; ++view) {
    const Eigen::Vector3d eye(1.3 + 1.4 * unit(random), 1.0 + 1.2 * unit(random), 0.7 + 1.2 * unit(random));
    const Eigen::Vector3d target(1.0 * unit(random), 1.0 * unit(random), 1.0 * unit(random));
    const auto pose = lookAt(eye, target);
    volume.integrate(render(scene, camera(640, 480), pose), camera(640, 480), pose);
  }
  const std::vector<double> errors = crossingErrors(volume, scene);
  ASSERT_GT(errors.size(), 20000U);
  EXPECT_LE(rms(errors), kBar);
}

TEST(DepthFusion, NothingIsObservedBeyondTheBandBehindASurface) {
  const Scene scene = Scene().room({0, 0, 0}, {3, 3, 2.5});
  TsdfVolume volume;
  for (const Eigen::Vector3d& target :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(3, 0, 0), Eigen::Vector3d(0, 3, 2)}) {
    const auto pose = lookAt({1.6, 1.4, 1.2}, target);
    volume.integrate(render(scene, camera(), pose), camera(), pose);
  }
  const double behind = -volume.options().truncation - 1e-6;
  for (auto voxel = volume.grids().tsdf->cbeginValueOn(); voxel; ++voxel) {
    ASSERT_GE(scene.distance(worldPosition(volume, voxel.getCoord())), behind) << voxel.getCoord();
  }
  openvdb::MaskTree free(volume.grids().free->tree());
  free.voxelizeActiveTiles();
  for (auto voxel = free.cbeginValueOn(); voxel; ++voxel) {
    ASSERT_GT(scene.distance(worldPosition(volume, voxel.getCoord())), 0.0) << voxel.getCoord();
  }
}

TEST(DepthFusion, FreeIsToldFromUnknownByRays) {
  // A box in front of a wall: brute force over all voxels by their own ray.
  const Scene scene = Scene().plane({0, 0, -1}, -2.5).box({-0.3, -0.2, 1.2}, {0.2, 0.3, 1.4});
  const CameraIntrinsics k = camera();
  const Eigen::Isometry3d pose(Eigen::Translation3d(0.05, 0.02, 0.0));
  TsdfVolume volume;
  volume.integrate(render(scene, k, pose), k, pose);
  const VoxelReader reader(volume.grids());
  const double truncation = volume.options().truncation;
  int free = 0, unknown = 0;
  for (int x = -80; x <= 80; ++x) {
    for (int y = -80; y <= 80; ++y) {
      for (int z = -10; z <= 140; ++z) {
        const openvdb::Coord ijk(x, y, z);
        const Eigen::Vector3d p = pose.inverse() * worldPosition(volume, ijk);
        const VoxelState state = reader.state(ijk);
        const double u = k.fx * p.x() / p.z() + k.cx, v = k.fy * p.y() / p.z() + k.cy;
        if (p.z() <= 0.0 || u < -1.0 || v < -1.0 || u > k.width || v > k.height) {
          ASSERT_EQ(state, VoxelState::kUnknown) << ijk;
          continue;
        }
        // Depth of the surface along this and the neighbouring rays.
        double nearest = 1e9, farthest = 0.0;
        for (int du = -4; du <= 4; ++du) {
          for (int dv = -4; dv <= 4; ++dv) {
            const Eigen::Vector3d ray = testing::pixelRay(k, u + du, v + dv);
            const double depth = scene.range(pose.translation(), ray.normalized()) / ray.norm();
            nearest = std::min(nearest, depth), farthest = std::max(farthest, depth);
          }
        }
        if (p.z() > farthest + 2.0 * truncation) {
          ASSERT_EQ(state, VoxelState::kUnknown) << ijk;
          ++unknown;
        } else if (p.z() > 0.1 && p.z() < nearest - 2.5 * truncation && u > 1 && v > 1 && u < k.width - 2 &&
                   v < k.height - 2) {
          ASSERT_EQ(state, VoxelState::kFree) << ijk;
          ++free;
        }
      }
    }
  }
  EXPECT_GT(free, 100000);
  EXPECT_GT(unknown, 10000);
  // Whole free leaves are tiles.
  EXPECT_GT(volume.grids().free->tree().activeTileCount(), 100U);
}

TEST(DepthFusion, MeshOfOpenVdbLiesOnTheSurface) {
  // The half-voxel trap: OpenVDB's own tool must find the plane where it is in the map frame.
  const Eigen::Vector3d normal = Eigen::Vector3d(0.1, 0.2, 1.0).normalized();
  const Scene scene = Scene().plane(normal, 0.0137);
  TsdfVolume volume;
  const auto pose = lookAt({0.1, 0.0, 1.4}, {0.0, 0.1, 0.0});
  volume.integrate(render(scene, camera(), pose), camera(), pose);
  // OpenVDB takes what is not active for outside; behind the shell it has to be told otherwise.
  const openvdb::FloatGrid::Ptr closed = volume.grids().tsdf->deepCopy();
  openvdb::tools::signedFloodFill(closed->tree());
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(*closed, points, quads);
  ASSERT_GT(quads.size(), 1000U);
  std::vector<double> errors;
  for (const auto& point : points) {
    // At the rim of the view the shell is open.
    const Eigen::Vector3d p(point.x(), point.y(), point.z());
    if (p.head<2>().cwiseAbs().maxCoeff() < 0.3) errors.push_back(scene.distance(p));
  }
  ASSERT_GT(errors.size(), 500U);
  double mean = 0.0;
  for (const double error : errors) mean += error / static_cast<double>(errors.size());
  EXPECT_LE(std::abs(mean), 0.01 * volume.options().voxel_size);
  EXPECT_LE(rms(errors), kBar * volume.options().voxel_size);
}

TEST(DepthFusion, DoesNotDependOnTheNumberOfThreads) {
  const Scene scene = Scene().room({0, 0, 0}, {3, 3, 2.5}).sphere({1.0, 0.8, 0.5}, 0.3);
  std::vector<TsdfVolume> volumes;
  for (const int threads : {1, 2, 5}) {
    FusionOptions options;
    options.threads = threads;
    TsdfVolume volume(options);
    for (const Eigen::Vector3d& eye :
         {Eigen::Vector3d(2, 2, 1), Eigen::Vector3d(2.2, 1.9, 1.4), Eigen::Vector3d(1, 2.5, 1)}) {
      const auto pose = lookAt(eye, {1.0, 0.8, 0.5});
      volume.integrate(render(scene, camera(), pose), camera(), pose);
    }
    volumes.push_back(std::move(volume));
  }
  EXPECT_FALSE(volumes[0].empty());
  EXPECT_TRUE(testing::sameVolumes(volumes[0], volumes[1]));
  EXPECT_TRUE(testing::sameVolumes(volumes[0], volumes[2]));
}

TEST(DepthFusion, FlippedImageAxisGivesTheSameVolume) {
  // fy < 0 (ICL-NUIM): rows run upwards. The same rays, stored the other way round, say the same.
  const Scene scene = Scene().room({0, 0, 0}, {3, 3, 2.5});
  const auto pose = lookAt({2, 2, 1}, {0.2, 0.1, 0.9});
  const CameraIntrinsics k = camera();
  const DepthImage image = render(scene, k, pose);
  CameraIntrinsics flipped_k = k;
  flipped_k.fy = -k.fy, flipped_k.cy = k.height - 1 - k.cy;
  DepthImage flipped = image;
  for (int v = 0; v < k.height; ++v) {
    for (int u = 0; u < k.width; ++u) {
      flipped.depth[static_cast<std::size_t>((k.height - 1 - v) * k.width + u)] = image.at(u, v);
    }
  }
  TsdfVolume a, b;
  a.integrate(image, k, pose);
  b.integrate(flipped, flipped_k, pose);
  EXPECT_GT(a.grids().tsdf->activeVoxelCount(), 10000U);
  // Voxels exactly between two rows of pixels may round to the other one.
  EXPECT_NEAR(static_cast<double>(b.grids().tsdf->activeVoxelCount()),
              static_cast<double>(a.grids().tsdf->activeVoxelCount()),
              1e-3 * static_cast<double>(a.grids().tsdf->activeVoxelCount()));
  EXPECT_NEAR(static_cast<double>(b.grids().free->activeVoxelCount()),
              static_cast<double>(a.grids().free->activeVoxelCount()),
              1e-3 * static_cast<double>(a.grids().free->activeVoxelCount()));
  std::vector<double> errors = crossingErrors(b, scene);
  EXPECT_GT(errors.size(), 5000U);
  EXPECT_LE(rms(errors), 2.0 * kBar);
}

TEST(DepthFusion, ReadingsOutOfRangeAddNoSurface) {
  const Scene scene = Scene().plane({0, 0, -1}, -3.0);
  const CameraIntrinsics k = camera();
  FusionOptions options;
  options.max_depth = 2.0;
  TsdfVolume volume(options);
  volume.integrate(render(scene, k, Eigen::Isometry3d::Identity()), k, Eigen::Isometry3d::Identity());
  EXPECT_TRUE(volume.empty());
  const VoxelReader reader(volume.grids());
  EXPECT_EQ(reader.state({0, 0, 97}), VoxelState::kFree);  // seen through, up to max_depth
  EXPECT_EQ(reader.state({0, 0, 103}), VoxelState::kUnknown);

  DepthImage nothing = render(scene, k, Eigen::Isometry3d::Identity());
  const float bad[] = {0.0F, std::nanf(""), INFINITY, -1.0F, 0.1F};
  for (std::size_t i = 0; i < nothing.depth.size(); ++i) nothing.depth[i] = bad[i % 5];
  TsdfVolume untouched;
  untouched.integrate(nothing, k, Eigen::Isometry3d::Identity());
  EXPECT_TRUE(untouched.empty());
  EXPECT_EQ(untouched.grids().free->activeVoxelCount(), 0U);
}

TEST(DepthFusion, WeightsFollowTheSensorsNoiseAndTheIncidence) {
  const auto weightOfPlane = [](double range, double incidence, const std::string& sensor = "kinect") {
    const Eigen::Vector3d eye(0.0, -range * std::sin(incidence), range * std::cos(incidence));
    FusionOptions options;
    options.sensor = sensor;
    TsdfVolume volume(options);
    const auto pose = lookAt(eye, Eigen::Vector3d::Zero());
    volume.integrate(render(Scene().plane({0, 0, 1}, 0.0), camera(), pose), camera(), pose);
    return static_cast<double>(VoxelReader(volume.grids()).weight({0, 0, 0}));
  };
  // A quarter of a voxel of 2 cm beside 1.9 and 6.2 mm of a Kinect's noise.
  const auto wanted = [](double sigma) { return 25e-6 / (25e-6 + sigma * sigma); };
  EXPECT_NEAR(weightOfPlane(1.0, 0.0), wanted(0.001925), 1e-3);
  EXPECT_NEAR(weightOfPlane(2.0, 0.0), wanted(0.0062), 1e-3);
  EXPECT_NEAR(weightOfPlane(1.0, M_PI / 3), 0.5 * wanted(0.001925), 1e-2);
  EXPECT_EQ(weightOfPlane(1.0, 85.0 * M_PI / 180.0), 0.0);
  EXPECT_NEAR(weightOfPlane(1.0, 0.0, "exact"), 1.0, 1e-3);
  EXPECT_NEAR(weightOfPlane(3.0, 0.0, "exact"), 1.0, 1e-3);
  EXPECT_GT(weightOfPlane(3.0, 0.0, "lidar") / weightOfPlane(1.0, 0.0, "lidar"), 0.9);
}

TEST(DepthFusion, FlyingPixelsBetweenForegroundAndBackgroundAreDropped) {
  const Scene scene = Scene().plane({0, 0, -1}, -2.0).box({-5.0, -5.0, 1.0}, {0.0, 5.0, 1.1});
  const CameraIntrinsics k = camera();
  DepthImage image = render(scene, k, Eigen::Isometry3d::Identity());
  // Mixed readings along the box's edge, as real sensors have them.
  for (int v = 0; v < k.height; ++v) {
    const int edge = static_cast<int>(std::floor(k.cx)) + 1;
    image.depth[static_cast<std::size_t>(v * k.width + edge)] = 1.5F;
  }
  TsdfVolume volume;
  volume.integrate(image, k, Eigen::Isometry3d::Identity());
  for (auto voxel = volume.grids().tsdf->cbeginValueOn(); voxel; ++voxel) {
    const double z = worldPosition(volume, voxel.getCoord()).z();
    ASSERT_FALSE(z > 1.2 && z < 1.9) << voxel.getCoord();
  }
}

TEST(DepthFusion, RefusesBadArguments) {
  const Scene scene = Scene().plane({0, 0, -1}, -2.0);
  const CameraIntrinsics k = camera();
  const DepthImage image = render(scene, k, Eigen::Isometry3d::Identity());
  TsdfVolume volume;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation().x() = std::nan("");
  EXPECT_THROW(volume.integrate(image, k, pose), std::invalid_argument);
  pose.translation().x() = 1e12;
  EXPECT_THROW(volume.integrate(image, k, pose), std::invalid_argument);
  pose = Eigen::Isometry3d::Identity();
  pose.matrix()(0, 0) = -1.0;
  EXPECT_THROW(volume.integrate(image, k, pose), std::invalid_argument);
  CameraIntrinsics other = k;
  other.width += 1;
  EXPECT_THROW(volume.integrate(image, other, Eigen::Isometry3d::Identity()), std::invalid_argument);
  other = k;
  other.fx = 0.0;
  EXPECT_THROW(volume.integrate(image, other, Eigen::Isometry3d::Identity()), std::invalid_argument);
  DepthImage cut = image;
  cut.depth.pop_back();
  EXPECT_THROW(volume.integrate(cut, k, Eigen::Isometry3d::Identity()), std::invalid_argument);
  EXPECT_TRUE(volume.empty());
  EXPECT_EQ(volume.frameCount(), 0U);

  FusionOptions options;
  options.truncation = 0.01;
  EXPECT_THROW(TsdfVolume{options}, std::invalid_argument);
  options = {};
  options.voxel_size = std::nan("");
  EXPECT_THROW(TsdfVolume{options}, std::invalid_argument);
  options = {};
  options.max_depth = 0.1;
  EXPECT_THROW(TsdfVolume{options}, std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
