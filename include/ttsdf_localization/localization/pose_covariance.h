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

/// Keeps `measured` but for its `weak` weakest directions (those where it is largest compared with `prior`),
/// in which nothing better than the prior is known. Both positive definite; independent of units and of the
/// point they are about.
Matrix6d withPriorInWeakDirections(const Matrix6d& measured, const Matrix6d& prior, int weak);

/// Symmetric, no negative eigenvalue, finite.
bool isCovariance(const Matrix6d& covariance);

}  // namespace ttsdf
