#include "ttsdf_localization/geometry/se3.h"

#include <Eigen/SVD>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace ttsdf {

Eigen::Matrix3d hat(const Eigen::Vector3d& w) {
  Eigen::Matrix3d m;
  m << 0.0, -w.z(), w.y(), w.z(), 0.0, -w.x(), -w.y(), w.x(), 0.0;
  return m;
}

Eigen::Matrix3d expSo3(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  // A quaternion with sin(a/2)/a by series below 1e-4 keeps full precision at the origin.
  const double k = angle < 1e-4 ? 0.5 - angle * angle / 48.0 : std::sin(0.5 * angle) / angle;
  return Eigen::Quaterniond(std::cos(0.5 * angle), k * w.x(), k * w.y(), k * w.z())
      .normalized()
      .toRotationMatrix();
}

Eigen::Vector3d logSo3(const Eigen::Matrix3d& R) {
  // Through the quaternion: well conditioned at pi, where (R - R^T) vanishes.
  Eigen::Quaterniond q(R);
  q.normalize();
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  if (sine < 1e-10) return 2.0 * q.vec();
  return (2.0 * std::atan2(sine, q.w()) / sine) * q.vec();
}

Eigen::Matrix3d leftJacobianSo3(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  const double a2 = angle * angle;
  const Eigen::Matrix3d W = hat(w);
  double b = 0.0, c = 0.0;
  if (angle < 1e-3) {
    b = 0.5 - a2 / 24.0;
    c = 1.0 / 6.0 - a2 / 120.0;
  } else {
    b = (1.0 - std::cos(angle)) / a2;
    c = (angle - std::sin(angle)) / (a2 * angle);
  }
  return Eigen::Matrix3d::Identity() + b * W + c * W * W;
}

Eigen::Isometry3d expSe3(const Vector6d& xi) {
  const Eigen::Vector3d w = xi.head<3>();
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = expSo3(w);
  T.translation() = leftJacobianSo3(w) * xi.tail<3>();
  return T;
}

Vector6d logSe3(const Eigen::Isometry3d& T) {
  Vector6d xi;
  const Eigen::Vector3d w = logSo3(T.linear());
  xi.head<3>() = w;
  xi.tail<3>() = leftJacobianSo3(w).partialPivLu().solve(T.translation());
  return xi;
}

Matrix6d adjoint(const Eigen::Isometry3d& T) {
  Matrix6d A = Matrix6d::Zero();
  A.topLeftCorner<3, 3>() = T.linear();
  A.bottomRightCorner<3, 3>() = T.linear();
  A.bottomLeftCorner<3, 3>() = hat(T.translation()) * T.linear();
  return A;
}

Eigen::Isometry3d orthonormalized(const Eigen::Matrix4d& matrix, double tolerance) {
  if (!matrix.allFinite())
    throw std::invalid_argument("pose: got NaN or infinite entries, wanted a finite 4x4 matrix");
  const Eigen::Matrix3d M = matrix.topLeftCorner<3, 3>();
  const double deviation = (M * M.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  const bool affine =
      (matrix.row(3) - Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0)).cwiseAbs().maxCoeff() <= tolerance;
  if (deviation > tolerance || M.determinant() <= 0.0 || !affine) {
    std::ostringstream text;
    text << "pose: got a rotation block with |R R^T - I| = " << deviation << " and determinant "
         << M.determinant() << " above the row " << matrix.row(3)
         << ", wanted a rotation (|R R^T - I| <= " << tolerance << ") above 0 0 0 1";
    throw std::invalid_argument(text.str());
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = svd.matrixU() * svd.matrixV().transpose();
  T.translation() = matrix.topRightCorner<3, 1>();
  return T;
}

PoseError poseError(const Eigen::Isometry3d& T_a, const Eigen::Isometry3d& T_b) {
  const Eigen::Isometry3d difference = T_a.inverse() * T_b;
  return {difference.translation().norm(), logSo3(difference.linear()).norm()};
}

Matrix6d swapCovarianceOrder(const Matrix6d& covariance) {
  Matrix6d swapped;
  swapped.topLeftCorner<3, 3>() = covariance.bottomRightCorner<3, 3>();
  swapped.bottomRightCorner<3, 3>() = covariance.topLeftCorner<3, 3>();
  swapped.topRightCorner<3, 3>() = covariance.bottomLeftCorner<3, 3>();
  swapped.bottomLeftCorner<3, 3>() = covariance.topRightCorner<3, 3>();
  return swapped;
}

}  // namespace ttsdf
