#pragma once
// A depth camera on a body that moves through a world: images, drifting odometry and the truth, by the clock.

#include <cstdint>
#include <string>

#include "ttsdf_localization/simulation/depth_camera.h"
#include "ttsdf_localization/simulation/drifting_odometry.h"
#include "ttsdf_localization/simulation/moving_clutter.h"
#include "ttsdf_localization/simulation/trajectory.h"
#include "ttsdf_localization/simulation/worlds.h"

namespace ttsdf {

/// Where the camera sits on the body.
struct CameraMountOptions {
  double camera_x = 0.1;      ///< forward of the base [m]
  double camera_y = 0.0;      ///< left [m]
  double camera_z = 0.05;     ///< up [m]
  double camera_pitch = 0.0;  ///< positive looks down [rad]
};
const OptionTable<CameraMountOptions>& cameraMountOptionTable();

/// Pose of the optical frame (z forward, x right, y down) in the body frame (x forward, y left, z up).
Eigen::Isometry3d opticalMount(const CameraMountOptions& mount);

struct SimulatedRigOptions {
  std::string scene = "apartment";
  double start_time = 0.0;  ///< where on its path the camera starts [s]
  CameraMountOptions mount;
  DepthCameraOptions camera;
  TrajectoryOptions path;
  OdometryOptions odometry;
  ClutterOptions clutter;
};
/// The fields of SimulatedRigOptions itself; its groups have tables of their own.
const OptionTable<SimulatedRigOptions>& simulatedRigOptionTable();

struct RigState {
  std::uint64_t step = 0;  ///< number of the state, chooses the noise of its image
  double time = 0.0;       ///< [s]
  Eigen::Isometry3d T_map_base = Eigen::Isometry3d::Identity();   ///< the truth
  Eigen::Isometry3d T_odom_base = Eigen::Isometry3d::Identity();  ///< what odometry says
};

class SimulatedRig {
 public:
  /// Throws std::invalid_argument for bad options.
  explicit SimulatedRig(const SimulatedRigOptions& options);

  const World& world() const { return world_; }
  const Trajectory& trajectory() const { return trajectory_; }
  const DepthCamera& camera() const { return camera_; }
  const Eigen::Isometry3d& cameraMount() const { return T_base_camera_; }  ///< T_base_camera

  /// State at a time [s] after the start; times must rise.
  RigState advance(double time);
  /// What the camera sees in that state. Thread-safe.
  DepthImage image(const RigState& state) const;
  /// Kidnapping: the camera goes on from the next place of its path that is at least `distance` [m] away (or
  /// the farthest one), and odometry does not notice. Returns the distance of the jump [m].
  double jump(double distance);

 private:
  World world_;
  Trajectory trajectory_;
  DepthCamera camera_;
  DriftingOdometry odometry_;
  MovingClutter clutter_;
  Eigen::Isometry3d T_base_camera_;
  double path_offset_;  // path time - time [s]
  RigState state_;
};

}  // namespace ttsdf
