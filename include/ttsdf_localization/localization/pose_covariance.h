#pragma once
// Covariances of poses: moved between points of a rigid body, widened, and filled in where a scan gives no
// information. All are of the left perturbation [rotation; translation] in map axes, about the position of a
// named frame.

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

/// The covariance about another point of the same body; `offset` = new point - old point, in map axes [m].
Matrix6d movedCovariance(const Matrix6d& covariance, const Eigen::Vector3d& offset);

/// Diagonal covariance from standard deviations.
Matrix6d isotropicCovariance(double rotation_sigma, double translation_sigma);

/// Mahalanobis distance between a pose and a prior, whose standard deviations are at least 0.02 rad and 5 cm:
/// nobody points more exactly.
double deviation(const Eigen::Isometry3d& T, const Eigen::Isometry3d& T_prior, const Matrix6d& covariance);
/// Above this a pose has nothing to do with the prior: 99.97 % of six normal variables.
constexpr double kMaxDeviation = 5.0;

/// A pose and how well it is known.
struct PoseEstimate {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  Matrix6d covariance = Matrix6d::Zero();
};

/// The prior as it is, or, if a pose found contradicts it beyond chance (99.9 %), less certain in the
/// direction of the contradiction, so that no more than chance is left of it: as after slipping wheels.
PoseEstimate inflatedToInclude(const PoseEstimate& prior, const Eigen::Isometry3d& T);

/// Keeps `measured` but for the directions in which `prior` is the surer one: nothing is known worse than the
/// prior knew it. Both positive definite; independent of units and of the point they are about.
Matrix6d covarianceBoundedBy(const Matrix6d& measured, const Matrix6d& prior);

/// Symmetric, no negative eigenvalue, finite.
bool isCovariance(const Matrix6d& covariance);

}  // namespace ttsdf
