#include "ttsdf_localization/simulation/pose_noise.h"

#include <cmath>

namespace ttsdf {

const OptionTable<PoseNoiseOptions>& poseNoiseOptionTable() {
  using O = PoseNoiseOptions;
  static const OptionTable<O> kTable =
      OptionTable<O>()
          .add("pose_noise", &O::pose_noise, 0.0, 10.0, "m",
               "Rms error of the frames' recorded positions; the exact poses then go beside them "
               "(frame-NNNNNN.truth.txt).")
          .add("pose_angle_noise", &O::pose_angle_noise, 0.0, 1.0, "rad", "Rms error of their orientations.")
          .add("pose_noise_correlation", &O::pose_noise_correlation, 0.0, 1e6, "frames",
               "Frames after which 1/e of a pose's error is left; 0: independent from frame to frame.")
          .add("pose_noise_seed", &O::pose_noise_seed, 0, 1000000000, "", "Seed of the poses' errors.");
  return kTable;
}

PoseNoise::PoseNoise(const PoseNoiseOptions& options)
    : options_(options), random_(static_cast<std::uint64_t>(options.pose_noise_seed)) {
  poseNoiseOptionTable().validate(options);
  error_ = draw();
}

Vector6d PoseNoise::draw() {
  std::normal_distribution<double> normal;
  Vector6d error;
  // Three components share the mean square of the vector.
  for (int i = 0; i < 6; ++i) {
    error[i] = normal(random_) * (i < 3 ? options_.pose_angle_noise : options_.pose_noise) / std::sqrt(3.0);
  }
  return error;
}

Eigen::Isometry3d PoseNoise::perturb(const Eigen::Isometry3d& T_map_camera) {
  Eigen::Isometry3d recorded = T_map_camera;
  recorded.linear() = T_map_camera.linear() * expSo3(error_.head<3>());
  recorded.translation() += error_.tail<3>();
  const double correlation = options_.pose_noise_correlation;
  const double keep = correlation > 0.0 ? std::exp(-1.0 / correlation) : 0.0;
  error_ = keep * error_ + std::sqrt(1.0 - keep * keep) * draw();
  return recorded;
}

}  // namespace ttsdf
