#pragma once
// Left perturbations [rotation; translation] of a pose about the position of a named frame, axes of the outer
// frame: the convention of every prior and covariance here.

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

/// The perturbation that takes T_from to T_to, rotation and translation apart: [log(R_to R_from^T); t_to -
/// t_from].
inline Vector6d posePerturbation(const Eigen::Isometry3d& T_from, const Eigen::Isometry3d& T_to) {
  Vector6d xi;
  xi << logSo3(T_to.linear() * T_from.linear().transpose()), T_to.translation() - T_from.translation();
  return xi;
}

/// Jacobian of the same perturbation about another point of the rigid body, [I 0; lever^ I]. `lever`: from
/// the new point to the old one [m]; a rotation w moves the new point by -w x lever = lever^ w.
inline Matrix6d leverArmJacobian(const Eigen::Vector3d& lever) {
  Matrix6d J = Matrix6d::Identity();
  J.bottomLeftCorner<3, 3>() = hat(lever);
  return J;
}

}  // namespace ttsdf
