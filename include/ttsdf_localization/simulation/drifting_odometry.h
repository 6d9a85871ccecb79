#pragma once
// Odometry as a robot measures it: relative motion that is right at every step but for an error that grows
// with the distance travelled.

#include <Eigen/Geometry>
#include <optional>
#include <random>

#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

struct OdometryOptions {
  double translation_drift = 0.05;  ///< rms error per distance [m/m]
  double rotation_drift = 0.05;     ///< rms error per distance [rad/m]
  double correlation_length = 5.0;  ///< distance over which the error keeps its direction [m]
  int odometry_seed = 1;
};
const OptionTable<OdometryOptions>& odometryOptionTable();

/// The drift per metre is a vector (one for translation, one for rotation) that changes slowly: an
/// Ornstein-Uhlenbeck process over the distance s with correlation length L. Its integral, the error, has the
/// mean square 2 d^2 L^2 (s / L - 1 + e^(-s / L)): d s over short distances, d sqrt(2 L s) over long ones.
class DriftingOdometry {
 public:
  /// Throws std::invalid_argument for bad options.
  explicit DriftingOdometry(const OdometryOptions& options = {});

  /// Takes the true pose of the base, gives the odometry's: T_odom_base. The first pose becomes the identity.
  Eigen::Isometry3d update(const Eigen::Isometry3d& T_map_base);
  /// The world moved the robot (kidnapping, wheels off the ground): the next pose counts as no motion.
  void skip() { T_map_base_before_.reset(); }
  const Eigen::Isometry3d& pose() const { return T_odom_base_; }

 private:
  using Drift = Eigen::Matrix<double, 6, 1>;  // per metre: rotation [rad/m], translation [m/m]
  Drift drawDrift();

  OdometryOptions options_;
  std::mt19937_64 random_;
  Drift drift_ = Drift::Zero();
  std::optional<Eigen::Isometry3d> T_map_base_before_;
  Eigen::Isometry3d T_odom_base_ = Eigen::Isometry3d::Identity();
};

}  // namespace ttsdf
