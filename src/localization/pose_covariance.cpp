#include "ttsdf_localization/localization/pose_covariance.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "ttsdf_localization/geometry/pose_perturbation.h"

namespace ttsdf {

Matrix6d movedCovariance(const Matrix6d& covariance, const Eigen::Vector3d& offset) {
  const Matrix6d J = leverArmJacobian(-offset);
  return J * covariance * J.transpose();
}

Matrix6d isotropicCovariance(double rotation_sigma, double translation_sigma) {
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(rotation_sigma * rotation_sigma),
      Eigen::Vector3d::Constant(translation_sigma * translation_sigma);
  return variances.asDiagonal();
}

double deviation(const Eigen::Isometry3d& T, const Eigen::Isometry3d& T_prior, const Matrix6d& covariance) {
  const Vector6d xi = posePerturbation(T_prior, T);
  const Matrix6d spread = covariance + isotropicCovariance(0.02, 0.05);  // nobody points more exactly
  return std::sqrt(std::max(0.0, xi.dot(spread.ldlt().solve(xi))));
}

PoseEstimate inflatedToInclude(const PoseEstimate& prior, const Eigen::Isometry3d& T) {
  constexpr double kChance = 22.5;  // 99.9 % quantile of the chi-squared distribution of 6 degrees of freedom
  const Vector6d xi = posePerturbation(prior.T, T);
  const double deviation = xi.dot(prior.covariance.ldlt().solve(xi));
  if (!(deviation > kChance)) return prior;
  // By Sherman and Morrison this leaves a deviation of exactly kChance.
  return {prior.T, prior.covariance + (1.0 / kChance - 1.0 / deviation) * xi * xi.transpose()};
}

Matrix6d covarianceBoundedBy(const Matrix6d& measured, const Matrix6d& prior) {
  // W diagonalises both at once: W^T prior W = 1 and W^T measured W = ratios, rising.
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6d> both(measured, prior);
  if (both.info() != Eigen::Success) return measured;
  const Vector6d ratios = both.eigenvalues().cwiseMin(1.0);
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
