// Oracle: one exact ray per pixel; the noise model's own formulas.
#include "ttsdf_localization/simulation/depth_camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ttsdf_localization/simulation/worlds.h"

namespace ttsdf {
namespace {

/// Optical frame (z forward, x right, y down) of a body frame (x forward, z up).
Eigen::Isometry3d optical(const Eigen::Isometry3d& T_map_base) {
  Eigen::Matrix3d R;
  R << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  Eigen::Isometry3d T = T_map_base;
  T.linear() = T_map_base.linear() * R;
  return T;
}

DepthCameraOptions smallCamera() {
  DepthCameraOptions options;
  options.width = 160;
  options.height = 120;
  options.fx = options.fy = 131.0;
  return options;
}

/// A camera 2 m in front of the plane y = 2, looking straight at it.
Eigen::Isometry3d facingTheWall(double distance) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(0.5 * 3.14159265358979323846, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.translation() << 0.0, 2.0 - distance, 0.0;
  return optical(T);
}

class RenderedWorld : public testing::TestWithParam<std::string> {};

TEST_P(RenderedWorld, EveryPixelIsItsRaysFirstHit) {
  const World world = makeWorld(GetParam());
  const Trajectory trajectory(world.tour, world.closed);
  const DepthCamera camera(smallCamera());
  const CameraIntrinsics& k = camera.intrinsics();
  long readings = 0;
  for (int view = 0; view < 7; ++view) {
    const Eigen::Isometry3d T = optical(trajectory.pose(trajectory.duration() * (view + 0.3) / 7.0));
    const DepthImage image = camera.render(world.scene, T);
    for (int v = 0; v < k.height; v += 3) {
      for (int u = 0; u < k.width; u += 2) {
        const Eigen::Vector3d ray((u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0);
        const auto hit = world.scene.castRay(T.translation(), T.linear() * ray);
        const double z = hit ? hit->distance / ray.norm() : 0.0;
        const bool in_range = z >= camera.options().min_range && z <= camera.options().max_range;
        if (std::abs(z - 5.0) < 1e-6 || std::abs(z - 0.3) < 1e-6) continue;
        const float expected = in_range ? static_cast<float>(z) : 0.0f;
        // Rays through an edge may fall on either side of it by rounding; nothing else may differ.
        if (std::abs(image.at(u, v) - expected) > 1e-5f) {
          const auto beside =
              world.scene.castRay(T.translation(), T.linear() * (ray + Eigen::Vector3d(1e-9, 1e-9, 0.0)));
          const auto other =
              world.scene.castRay(T.translation(), T.linear() * (ray - Eigen::Vector3d(1e-9, 1e-9, 0.0)));
          const double a = beside ? beside->distance / ray.norm() : 0.0,
                       b = other ? other->distance / ray.norm() : 0.0;
          EXPECT_TRUE(std::abs(image.at(u, v) - a) < 1e-5 || std::abs(image.at(u, v) - b) < 1e-5)
              << "pixel " << u << ' ' << v << " view " << view << ": " << image.at(u, v) << " instead of "
              << expected;
        }
        readings += in_range;
      }
    }
  }
  EXPECT_GT(readings, 5000);
}

INSTANTIATE_TEST_SUITE_P(Worlds, RenderedWorld, testing::Values("apartment", "building", "room", "corridor"),
                         [](const auto& param) { return param.param; });

TEST(DepthCamera, PointsOfANoiseFreeImageLieOnTheScene) {
  const World world = makeWorld("apartment");
  const Trajectory trajectory(world.tour, true);
  const DepthCamera camera{DepthCameraOptions{}};
  const CameraIntrinsics& k = camera.intrinsics();
  const Eigen::Isometry3d T = optical(trajectory.pose(11.0));
  const DepthImage image = camera.render(world.scene, T);
  ASSERT_EQ(image.depth.size(), 640u * 480u);
  for (int v = 0; v < k.height; v += 7) {
    for (int u = 0; u < k.width; u += 7) {
      const double z = image.at(u, v);
      if (z == 0.0) continue;
      const Eigen::Vector3d p = T * (z * Eigen::Vector3d((u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0));
      EXPECT_LT(std::abs(world.scene.signedDistance(p)),
                1e-6);  // float depth: half a unit in the last place at 5 m
    }
  }
}

TEST(DepthCamera, NoiseHasTheModelsSigma) {
  DepthCameraOptions options = smallCamera();
  options.noise.noise_base = 0.002;
  options.noise.noise_quadratic = 0.0015;
  const DepthCamera camera(options);
  const AnalyticScene wall = makeSingleWall();
  for (const double distance : {0.8, 2.0, 4.0}) {
    const DepthImage image = camera.render(wall, facingTheWall(distance), 3);
    double sum = 0.0, square = 0.0;
    for (const float z : image.depth) {
      ASSERT_GT(z, 0.0f);
      sum += z - distance;
      square += (z - distance) * (z - distance);
    }
    const double n = static_cast<double>(image.depth.size());
    const double sigma = 0.002 + 0.0015 * distance * distance;
    EXPECT_NEAR(sum / n, 0.0, 5.0 * sigma / std::sqrt(n));
    EXPECT_NEAR(std::sqrt(square / n) / sigma, 1.0, 5.0 / std::sqrt(2.0 * n));
  }
}

TEST(DepthCamera, NoiseIsIndependentFromPixelToPixelAndFrameToFrame) {
  DepthCameraOptions options = smallCamera();
  options.noise.noise_base = 0.01;
  const DepthCamera camera(options);
  const AnalyticScene wall = makeSingleWall();
  const DepthImage a = camera.render(wall, facingTheWall(2.0), 1),
                   b = camera.render(wall, facingTheWall(2.0), 2);
  double along_row = 0.0, along_column = 0.0, between = 0.0;
  for (int v = 0; v + 1 < a.height; ++v) {
    for (int u = 0; u + 1 < a.width; ++u) {
      const double noise = (a.at(u, v) - 2.0) / 0.01;
      along_row += noise * (a.at(u + 1, v) - 2.0) / 0.01;
      along_column += noise * (a.at(u, v + 1) - 2.0) / 0.01;
      between += noise * (b.at(u, v) - 2.0) / 0.01;
    }
  }
  const double n = static_cast<double>(a.width - 1) * (a.height - 1);
  for (const double correlation : {along_row / n, along_column / n, between / n}) {
    EXPECT_LT(std::abs(correlation), 5.0 / std::sqrt(n));
  }
}

TEST(DepthCamera, DropoutLosesTheStatedShare) {
  DepthCameraOptions options = smallCamera();
  options.noise.dropout = 0.1;
  const DepthImage image = DepthCamera(options).render(makeSingleWall(), facingTheWall(2.0));
  const double n = static_cast<double>(image.depth.size());
  const double lost = static_cast<double>(std::count(image.depth.begin(), image.depth.end(), 0.0f));
  EXPECT_NEAR(lost / n, 0.1, 5.0 * std::sqrt(0.1 * 0.9 / n));
}

TEST(DepthCamera, GrazingViewsGiveNoReading) {
  // Above a floor, looking along it: rows below the angle's horizon are empty.
  DepthCameraOptions options = smallCamera();
  options.max_range = 20.0;
  options.noise.grazing_angle = 0.2;
  const DepthCamera camera(options);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().z() = 1.0;
  const DepthImage image = camera.render(makeFloor(), optical(T));
  const CameraIntrinsics& k = camera.intrinsics();
  for (int v = 0; v < k.height; ++v) {
    for (int u = 0; u < k.width; ++u) {
      const Eigen::Vector3d ray((u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0);
      const double angle = std::asin(ray.y() / ray.norm());  // y is down
      if (std::abs(angle - 0.2) < 1e-6) continue;
      EXPECT_EQ(image.at(u, v) > 0.0f, angle > 0.2) << u << ' ' << v;
    }
  }
}

TEST(DepthCamera, EdgesLoseReadingsAndFlatPartsDoNot) {
  DepthCameraOptions options = smallCamera();
  options.noise.edge_dropout = 1.0;
  AnalyticScene scene = makeSingleWall();
  scene.add(Solid::box(Eigen::Isometry3d(Eigen::Translation3d(0.0, 1.0, 0.0)), {0.4, 0.2, 0.4}));
  const DepthImage holes = DepthCamera(options).render(scene, facingTheWall(2.5));
  const DepthImage exact = DepthCamera(smallCamera()).render(scene, facingTheWall(2.5));
  int lost = 0;
  for (int v = 0; v < exact.height; ++v) {
    for (int u = 1; u + 1 < exact.width; ++u) {
      const bool edge = std::abs(exact.at(u + 1, v) - exact.at(u, v)) > 0.3 ||
                        std::abs(exact.at(u - 1, v) - exact.at(u, v)) > 0.3;
      EXPECT_EQ(holes.at(u, v), edge ? 0.0f : exact.at(u, v));
      lost += edge;
    }
  }
  EXPECT_GT(lost, 50);
}

TEST(DepthCamera, DisparityIsQuantised) {
  DepthCameraOptions options = smallCamera();
  options.noise.disparity_step = 0.125;
  const DepthCamera camera(options);
  const DepthImage image =
      camera.render(makeRoom(), optical(Trajectory(makeWorld("room").tour, true).pose(1.0)));
  const double scale = options.fx * options.noise.baseline / options.noise.disparity_step;
  int readings = 0;
  for (const float z : image.depth) {
    if (z == 0.0f) continue;
    ++readings;
    EXPECT_NEAR(scale / z, std::round(scale / z), 1e-3);
  }
  EXPECT_GT(readings, 1000);
}

TEST(DepthCamera, RangesAreHoles) {
  const AnalyticScene wall = makeSingleWall();
  const DepthCamera camera(smallCamera());
  for (const double distance : {0.29, 5.01}) {
    for (const float z : camera.render(wall, facingTheWall(distance)).depth) EXPECT_EQ(z, 0.0f);
  }
  for (const double distance : {0.31, 4.99}) {
    for (const float z : camera.render(wall, facingTheWall(distance)).depth) {
      EXPECT_NEAR(z, distance, 1e-6);
    }
  }
}

TEST(DepthCamera, ClutterHidesTheSceneBehindIt) {
  const AnalyticScene wall = makeSingleWall();
  const Solid person = Solid::box(Eigen::Isometry3d(Eigen::Translation3d(0.0, 1.0, 0.0)), {0.4, 0.2, 0.4});
  const DepthCamera camera(smallCamera());
  const DepthImage image = camera.render(wall, facingTheWall(2.0), 0, {person});
  EXPECT_NEAR(image.at(80, 60), 0.9, 1e-6);
  EXPECT_NEAR(image.at(2, 2), 2.0, 1e-6);
}

TEST(DepthCamera, ImageDoesNotDependOnTheNumberOfThreads) {
  DepthCameraOptions options = smallCamera();
  options.noise = kinectNoise();
  const World world = makeWorld("apartment");
  const Eigen::Isometry3d T = optical(Trajectory(world.tour, true).pose(5.0));
  const DepthImage one = DepthCamera(options).render(world.scene, T, 9);
  options.threads = 3;
  const DepthImage three = DepthCamera(options).render(world.scene, T, 9);
  EXPECT_EQ(one.depth, three.depth);
  options.noise.noise_seed = 2;
  EXPECT_NE(one.depth, DepthCamera(options).render(world.scene, T, 9).depth);
}

TEST(DepthCamera, RefusesOptionsAndPosesThatAreNone) {
  DepthCameraOptions options;
  options.width = 0;
  EXPECT_THROW(DepthCamera{options}, std::invalid_argument);
  options = {};
  options.max_range = options.min_range;
  EXPECT_THROW(DepthCamera{options}, std::invalid_argument);
  EXPECT_THROW(depthNoise("sonar"), std::invalid_argument);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().x() = NAN;
  EXPECT_THROW(DepthCamera{smallCamera()}.render(makeRoom(), T), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
