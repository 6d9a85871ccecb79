#pragma once
// Poses as a mapping system hands them out: each off by a centimetre or two, and neighbours in time by much
// the same.

#include <Eigen/Geometry>
#include <random>

#include "ttsdf_localization/geometry/se3.h"
#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

struct PoseNoiseOptions {
  double pose_noise = 0.0;              ///< rms error of the position [m]
  double pose_angle_noise = 0.0;        ///< rms error of the orientation [rad]
  double pose_noise_correlation = 0.0;  ///< frames after which 1/e of an error is left; 0: independent
  int pose_noise_seed = 1;
  bool none() const { return pose_noise == 0.0 && pose_angle_noise == 0.0; }
};
const OptionTable<PoseNoiseOptions>& poseNoiseOptionTable();

/// Errors of the position (map axes) and the orientation about the camera: each component an
/// Ornstein-Uhlenbeck process over the frames, stationary from the first one on.
class PoseNoise {
 public:
  /// Throws std::invalid_argument for bad options.
  explicit PoseNoise(const PoseNoiseOptions& options);
  /// The recorded pose of the next frame.
  Eigen::Isometry3d perturb(const Eigen::Isometry3d& T_map_camera);

 private:
  Vector6d draw();

  PoseNoiseOptions options_;
  std::mt19937_64 random_;
  Vector6d error_;  // [rotation; translation]
};

}  // namespace ttsdf
