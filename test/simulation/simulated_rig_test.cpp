#include "ttsdf_localization/simulation/simulated_rig.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {
namespace {

SimulatedRigOptions smallRig() {
  SimulatedRigOptions options;
  options.camera.width = 80;
  options.camera.height = 60;
  options.camera.fx = options.camera.fy = 66.0;
  options.mount.camera_pitch = 0.2;
  return options;
}

TEST(SimulatedRig, ImagesFitTheSceneThroughMountAndTruth) {
  SimulatedRig rig(smallRig());
  const CameraIntrinsics& k = rig.camera().intrinsics();
  for (double time = 0.0; time < 60.0; time += 7.3) {
    const RigState state = rig.advance(time);
    const DepthImage image = rig.image(state);
    int readings = 0;
    for (int v = 0; v < k.height; ++v) {
      for (int u = 0; u < k.width; ++u) {
        const double z = image.at(u, v);
        if (z == 0.0) continue;
        ++readings;
        const Eigen::Vector3d p_camera = z * Eigen::Vector3d((u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0);
        EXPECT_LT(std::abs(rig.world().scene.signedDistance(state.T_map_base * rig.cameraMount() * p_camera)),
                  1e-6);
      }
    }
    EXPECT_GT(readings, 1000);
  }
}

TEST(SimulatedRig, MountPutsOpticalAxesWhereTheyBelong) {
  CameraMountOptions mount;
  const Eigen::Isometry3d level = opticalMount(mount);
  EXPECT_TRUE((level.linear() * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitX()));   // forward
  EXPECT_TRUE((level.linear() * Eigen::Vector3d::UnitX()).isApprox(-Eigen::Vector3d::UnitY()));  // right
  EXPECT_TRUE((level.linear() * Eigen::Vector3d::UnitY()).isApprox(-Eigen::Vector3d::UnitZ()));  // down
  mount.camera_pitch = 0.3;
  EXPECT_NEAR((opticalMount(mount).linear() * Eigen::Vector3d::UnitZ()).z(), -std::sin(0.3), 1e-12);
}

TEST(SimulatedRig, OdometryFollowsTheTruthApartFromItsDrift) {
  SimulatedRigOptions options = smallRig();
  options.start_time = 3.0;
  options.odometry.translation_drift = options.odometry.rotation_drift = 0.0;
  SimulatedRig rig(options);
  const RigState first = rig.advance(0.0);
  EXPECT_TRUE(first.T_map_base.isApprox(rig.trajectory().pose(3.0)));
  EXPECT_TRUE(first.T_odom_base.isApprox(Eigen::Isometry3d::Identity()));
  const RigState later = rig.advance(2.0);
  EXPECT_TRUE((first.T_map_base * later.T_odom_base).isApprox(later.T_map_base, 1e-9));
}

TEST(SimulatedRig, AJumpMovesTheCameraAndNotTheOdometry) {
  SimulatedRig rig(smallRig());
  const RigState before = rig.advance(1.0);
  const double distance = rig.jump(5.0);
  const RigState after = rig.advance(1.0);
  EXPECT_GE(distance, 5.0);
  EXPECT_LT(distance, 5.5);
  EXPECT_NEAR((after.T_map_base.translation() - before.T_map_base.translation()).norm(), distance, 1e-9);
  EXPECT_TRUE(after.T_odom_base.isApprox(before.T_odom_base));
  // Farther than the world is wide: as far as it goes.
  EXPECT_LT(rig.jump(100.0), 13.0);
}

TEST(SimulatedRig, CluttersTheView) {
  SimulatedRigOptions options = smallRig();
  SimulatedRig empty(options);
  options.clutter.people = 5;
  SimulatedRig crowded(options);
  double hidden = 0.0, pixels = 0.0;
  for (double time = 0.0; time < 30.0; time += 1.0) {
    const DepthImage a = empty.image(empty.advance(time)), b = crowded.image(crowded.advance(time));
    for (std::size_t i = 0; i < a.depth.size(); ++i) {
      pixels += 1.0;
      hidden += a.depth[i] != b.depth[i];
    }
  }
  EXPECT_GT(hidden / pixels, 0.1);
  EXPECT_LT(hidden / pixels, 0.8);
}

TEST(SimulatedRig, RefusesUnknownScenesAndBadOptions) {
  SimulatedRigOptions options = smallRig();
  options.scene = "castle";
  EXPECT_THROW(SimulatedRig{options}, std::invalid_argument);
  options = smallRig();
  options.mount.camera_pitch = 3.0;
  EXPECT_THROW(SimulatedRig{options}, std::invalid_argument);
  options = smallRig();
  options.path.speed = -1.0;
  EXPECT_THROW(SimulatedRig{options}, std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
