#pragma once
// Rigid motions on Eigen. Convention of the whole project: T_a_b maps coordinates of frame b to frame a,
// a twist is [rotation; translation], and a pose is updated from the left, T <- Exp(xi) T.

#include <Eigen/Geometry>

namespace ttsdf {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Skew-symmetric matrix with hat(a) * b == a.cross(b). Every function here is pure and thread-safe.
Eigen::Matrix3d hat(const Eigen::Vector3d& w);

/// Rotation vector [rad] to rotation matrix (Rodrigues), exact near 0.
Eigen::Matrix3d expSo3(const Eigen::Vector3d& w);

/// Rotation matrix to rotation vector of length <= pi [rad], exact near 0 and near pi.
Eigen::Vector3d logSo3(const Eigen::Matrix3d& R);

/// Left Jacobian of SO(3): the translation part of Exp([w; v]) is leftJacobianSo3(w) * v.
Eigen::Matrix3d leftJacobianSo3(const Eigen::Vector3d& w);

/// Exp: se(3) -> SE(3), xi = [rotation rad; translation m].
Eigen::Isometry3d expSe3(const Vector6d& xi);

/// Log: SE(3) -> se(3), inverse of expSe3 for rotations below pi.
Vector6d logSe3(const Eigen::Isometry3d& T);

/// Adjoint for twists [rotation; translation]: Exp(adjoint(T) xi) = T Exp(xi) T^-1.
Matrix6d adjoint(const Eigen::Isometry3d& T);

/// Nearest rigid motion to a 4x4 matrix whose rotation block is only roughly orthonormal (polar projection).
/// Throws std::invalid_argument for NaN, a last row other than 0 0 0 1, a mirrored or a singular block, or a
/// block further than `tolerance` (largest absolute entry of R R^T - I) from a rotation.
Eigen::Isometry3d orthonormalized(const Eigen::Matrix4d& matrix, double tolerance = 0.05);

struct PoseError {
  double translation = 0.0;  ///< [m]
  double rotation = 0.0;     ///< [rad]
};

/// Error of the SE(3) difference T_a^-1 T_b, translation and rotation apart (paper, section VI,
/// Metrics).
PoseError poseError(const Eigen::Isometry3d& T_a, const Eigen::Isometry3d& T_b);

/// Swaps the 3x3 blocks between the library's [rotation; translation] and ROS's [translation; rotation]
/// order. The only place where the two orders meet; it is its own inverse.
Matrix6d swapCovarianceOrder(const Matrix6d& covariance);

}  // namespace ttsdf
