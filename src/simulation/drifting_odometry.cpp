#include "ttsdf_localization/simulation/drifting_odometry.h"

#include <cmath>

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

const OptionTable<OdometryOptions>& odometryOptionTable() {
  using O = OdometryOptions;
  static const OptionTable<O> kTable =
      OptionTable<O>()
          .add("translation_drift", &O::translation_drift, 0.0, 1.0, "m/m",
               "Rms translation error per distance.")
          .add("rotation_drift", &O::rotation_drift, 0.0, 3.0, "rad/m", "Rms rotation error per distance.")
          .add("correlation_length", &O::correlation_length, 0.01, 1000.0, "m",
               "Distance over which the odometry's error keeps its direction.")
          .add("odometry_seed", &O::odometry_seed, 0, 1000000000, "", "Seed of the odometry's error.");
  return kTable;
}

DriftingOdometry::DriftingOdometry(const OdometryOptions& options)
    : options_(options), random_(static_cast<std::uint64_t>(options.odometry_seed)) {
  odometryOptionTable().validate(options);
  drift_ = drawDrift();
}

DriftingOdometry::Drift DriftingOdometry::drawDrift() {
  std::normal_distribution<double> normal;
  Drift drift;
  // Three components share the mean square of the vector.
  for (int i = 0; i < 6; ++i) {
    drift[i] =
        normal(random_) * (i < 3 ? options_.rotation_drift : options_.translation_drift) / std::sqrt(3.0);
  }
  return drift;
}

Eigen::Isometry3d DriftingOdometry::update(const Eigen::Isometry3d& T_map_base) {
  if (T_map_base_before_) {
    const Eigen::Isometry3d motion = T_map_base_before_->inverse() * T_map_base;
    const double distance = motion.translation().norm();
    Eigen::Isometry3d error = Eigen::Isometry3d::Identity();
    error.linear() = expSo3(drift_.head<3>() * distance);
    error.translation() = drift_.tail<3>() * distance;
    T_odom_base_ = T_odom_base_ * motion * error;
    // Thousands of products wear the rotation down.
    T_odom_base_.linear() = Eigen::Quaterniond(T_odom_base_.linear()).normalized().toRotationMatrix();
    const double keep = std::exp(-distance / options_.correlation_length);
    drift_ = keep * drift_ + std::sqrt(1.0 - keep * keep) * drawDrift();
  }
  T_map_base_before_ = T_map_base;
  return T_odom_base_;
}

}  // namespace ttsdf
