#include "ttsdf_localization/registration/pose_prior.h"

#include <Eigen/Eigenvalues>

namespace ttsdf {

namespace {
Vector6d displacement(const Eigen::Isometry3d& T_prior, const Eigen::Isometry3d& T) {
  Vector6d e;
  e << logSo3(T.linear() * T_prior.linear().transpose()), T.translation() - T_prior.translation();
  return e;
}
}  // namespace

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
  const Vector6d e = displacement(T_map_sensor, T);
  return e.dot(information * e);
}

void PosePrior::add(const Eigen::Isometry3d& T, const Eigen::Vector3d& centroid, Matrix6d& H,
                    Vector6d& g) const {
  // A twist [w; v] about the centroid moves the sensor by v + w x (t - c).
  Matrix6d J = Matrix6d::Identity();
  J.bottomLeftCorner<3, 3>() = hat(T.linear() * centroid);
  H += J.transpose() * information * J;
  g += J.transpose() * information * displacement(T_map_sensor, T);
}

}  // namespace ttsdf
