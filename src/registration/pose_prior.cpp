#include "ttsdf_localization/registration/pose_prior.h"

#include <Eigen/Eigenvalues>

#include "ttsdf_localization/geometry/pose_perturbation.h"

namespace ttsdf {

PosePrior PosePrior::fromCovariance(const Eigen::Isometry3d& T_map_sensor, const Matrix6d& covariance) {
  constexpr double kLeastVariance = 1e-10;  // (10 um, 10 urad): nobody knows better
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(0.5 * (covariance + covariance.transpose()));
  const Vector6d inverse = solver.eigenvalues().cwiseMax(kLeastVariance).cwiseInverse();
  return {T_map_sensor, solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose()};
}

PosePrior PosePrior::fromSigmas(const Eigen::Isometry3d& T_map_sensor, double translation, double rotation) {
  PosePrior prior{T_map_sensor, Matrix6d::Zero()};
  prior.information.diagonal().head<3>().setConstant(1.0 / (rotation * rotation));
  prior.information.diagonal().tail<3>().setConstant(1.0 / (translation * translation));
  return prior;
}

double PosePrior::squaredDistance(const Eigen::Isometry3d& T) const {
  const Vector6d e = posePerturbation(T_map_sensor, T);
  return e.dot(information * e);
}

void PosePrior::add(const Eigen::Isometry3d& T, const Eigen::Vector3d& centroid, Matrix6d& H,
                    Vector6d& g) const {
  // A twist [w; v] about the centroid moves the sensor by v + w x (t - c).
  const Matrix6d J = leverArmJacobian(T.linear() * centroid);
  H += J.transpose() * information * J;
  g += J.transpose() * information * posePerturbation(T_map_sensor, T);
}

}  // namespace ttsdf
