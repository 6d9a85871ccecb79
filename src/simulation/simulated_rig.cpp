#include "ttsdf_localization/simulation/simulated_rig.h"

namespace ttsdf {

const OptionTable<CameraMountOptions>& cameraMountOptionTable() {
  using O = CameraMountOptions;
  static const OptionTable<O> kTable =
      OptionTable<O>()
          .add("camera_x", &O::camera_x, -10.0, 10.0, "m", "Camera forward of the base.")
          .add("camera_y", &O::camera_y, -10.0, 10.0, "m", "Camera left of the base.")
          .add("camera_z", &O::camera_z, -10.0, 10.0, "m", "Camera above the base.")
          .add("camera_pitch", &O::camera_pitch, -1.6, 1.6, "rad",
               "Pitch of the camera, positive looks down.");
  return kTable;
}

const OptionTable<SimulatedRigOptions>& simulatedRigOptionTable() {
  using O = SimulatedRigOptions;
  static const OptionTable<O> kTable =
      OptionTable<O>()
          .add("scene", &O::scene, worldNames(), "World that the camera moves in.")
          .add("start_time", &O::start_time, 0.0, 1e6, "s", "Where on its path the camera starts.");
  return kTable;
}

Eigen::Isometry3d opticalMount(const CameraMountOptions& mount) {
  Eigen::Matrix3d R_body_optical;
  R_body_optical << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << mount.camera_x, mount.camera_y, mount.camera_z;
  T.linear() =
      Eigen::AngleAxisd(mount.camera_pitch, Eigen::Vector3d::UnitY()).toRotationMatrix() * R_body_optical;
  return T;
}

SimulatedRig::SimulatedRig(const SimulatedRigOptions& options)
    : world_(makeWorld(options.scene)),
      trajectory_(world_.tour, world_.closed, options.path),
      camera_(options.camera),
      odometry_(options.odometry),
      clutter_(options.clutter),
      T_base_camera_(opticalMount(options.mount)),
      path_offset_(options.start_time) {
  simulatedRigOptionTable().validate(options);
  cameraMountOptionTable().validate(options.mount);
}

RigState SimulatedRig::advance(double time) {
  ++state_.step;
  state_.time = time;
  state_.T_map_base = trajectory_.pose(time + path_offset_);
  state_.T_odom_base = odometry_.update(state_.T_map_base);
  return state_;
}

DepthImage SimulatedRig::image(const RigState& state) const {
  return camera_.render(world_.scene, state.T_map_base * T_base_camera_, state.step,
                        clutter_.at(state.time, state.T_map_base));
}

double SimulatedRig::jump(double distance) {
  constexpr double kStep = 0.1;  // [s]
  const Eigen::Vector3d here = state_.T_map_base.translation();
  const double lap = trajectory_.closed() ? trajectory_.duration() : 2.0 * trajectory_.duration();
  double best_ahead = 0.0, best_distance = 0.0;
  for (double ahead = kStep; ahead < lap && best_distance < distance; ahead += kStep) {
    const Eigen::Isometry3d T = trajectory_.pose(state_.time + path_offset_ + ahead);
    const double away = (T.translation() - here).norm();
    if (away > best_distance) {
      best_distance = away;
      best_ahead = ahead;
    }
  }
  path_offset_ += best_ahead;
  odometry_.skip();
  return best_distance;
}

}  // namespace ttsdf
