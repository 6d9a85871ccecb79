#include "ttsdf_localization/localization/pose_covariance.h"

#include <Eigen/Eigenvalues>

namespace ttsdf {

Matrix6d movedCovariance(const Matrix6d& covariance, const Eigen::Vector3d& offset) {
  // A small rotation w moves the new point by w x offset = -hat(offset) w.
  Matrix6d J = Matrix6d::Identity();
  J.bottomLeftCorner<3, 3>() = -hat(offset);
  return J * covariance * J.transpose();
}

Matrix6d isotropicCovariance(double rotation_sigma, double translation_sigma) {
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(rotation_sigma * rotation_sigma),
      Eigen::Vector3d::Constant(translation_sigma * translation_sigma);
  return variances.asDiagonal();
}

Matrix6d withPriorInWeakDirections(const Matrix6d& measured, const Matrix6d& prior, int weak) {
  if (weak <= 0) return measured;
  // W diagonalises both at once: W^T prior W = 1 and W^T measured W = ratios, rising.
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6d> both(measured, prior);
  if (both.info() != Eigen::Success) return measured;
  Vector6d ratios = both.eigenvalues();
  ratios.tail(weak) = ratios.tail(weak).cwiseMin(1.0);
  const Matrix6d W_inverse = both.eigenvectors().transpose() * prior;
  return W_inverse.transpose() * ratios.asDiagonal() * W_inverse;
}

bool isCovariance(const Matrix6d& covariance) {
  if (!covariance.allFinite()) return false;
  const double largest = covariance.cwiseAbs().maxCoeff();
  if ((covariance - covariance.transpose()).cwiseAbs().maxCoeff() > 1e-6 * largest + 1e-12) return false;
  return Eigen::SelfAdjointEigenSolver<Matrix6d>(covariance, Eigen::EigenvaluesOnly).eigenvalues()[0] >=
         -1e-9 * largest;
}

}  // namespace ttsdf
