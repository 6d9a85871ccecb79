#pragma once
// What was known about the pose before the scan, as a term of the normal equations.

#include <Eigen/Geometry>

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

/// Normal distribution of the pose. `information` is of the left perturbation [rotation; translation] about
/// the sensor's position, map axes; zero: nothing is known.
struct PosePrior {
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  Matrix6d information = Matrix6d::Zero();

  /// From a covariance, of which every direction counts: a variance of zero is taken as a very small one.
  static PosePrior fromCovariance(const Eigen::Isometry3d& T_map_sensor, const Matrix6d& covariance);
  static PosePrior fromSigmas(const Eigen::Isometry3d& T_map_sensor, double translation, double rotation);

  /// Squared Mahalanobis distance of a pose.
  double squaredDistance(const Eigen::Isometry3d& T) const;

  /// Adds half the squared distance to normal equations whose twist is about `centroid` (sensor frame).
  void add(const Eigen::Isometry3d& T, const Eigen::Vector3d& centroid, Matrix6d& H, Vector6d& g) const;
};

}  // namespace ttsdf
