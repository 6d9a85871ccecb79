#include "ttsdf_localization/geometry/se3.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>

namespace ttsdf {
namespace {

/// The twist as an element of the Lie algebra: its matrix exponential is the oracle of expSe3.
Eigen::Matrix4d twistMatrix(const Vector6d& xi) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
  m.topLeftCorner<3, 3>() = hat(xi.head<3>());
  m.topRightCorner<3, 1>() = xi.tail<3>();
  return m;
}

/// Twists of every rotation angle that has trouble of its own: 0, around the switches to series, and up to
/// pi.
std::vector<Vector6d> twists() {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<Vector6d> all;
  for (const double angle : {0.0, 1e-14, 1e-10, 1e-7, 0.99e-4, 1.01e-4, 0.99e-3, 1.01e-3, 0.1, 1.0, 2.0, 3.0,
                             3.14, 3.1415926, M_PI}) {
    for (int n = 0; n < 6; ++n) {
      Eigen::Vector3d axis =
          n < 3 ? Eigen::Vector3d(Eigen::Vector3d::Unit(n))
                : Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
      Vector6d xi;
      xi << angle * axis, normal(random), normal(random), normal(random);
      all.push_back(xi);
    }
  }
  return all;
}

TEST(Se3, HatIsTheCrossProduct) {
  const Eigen::Vector3d a(1.0, -2.0, 3.0), b(0.5, 4.0, -1.0);
  EXPECT_TRUE((hat(a) * b).isApprox(a.cross(b), 1e-15));
}

TEST(Se3, ExpEqualsTheMatrixExponential) {
  for (const Vector6d& xi : twists()) {
    const Eigen::Matrix4d truth = twistMatrix(xi).exp();
    const double error = (expSe3(xi).matrix() - truth).cwiseAbs().maxCoeff();
    EXPECT_LT(error, 1e-12) << xi.transpose();
    EXPECT_LT((expSo3(xi.head<3>()) - truth.topLeftCorner<3, 3>()).cwiseAbs().maxCoeff(), 1e-12)
        << xi.transpose();
  }
}

TEST(Se3, ExpYieldsRotations) {
  for (const Vector6d& xi : twists()) {
    const Eigen::Matrix3d R = expSo3(xi.head<3>());
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-14);
    EXPECT_NEAR(R.determinant(), 1.0, 1e-14);
  }
}

TEST(Se3, LogInvertsExpUpToPi) {
  for (const Vector6d& xi : twists()) {
    const Vector6d back = logSe3(expSe3(xi));
    // At pi the rotation vector is known up to its sign only.
    const bool at_pi = xi.head<3>().norm() > 3.1415;
    if (at_pi) {
      const double error = (expSe3(back).matrix() - expSe3(xi).matrix()).cwiseAbs().maxCoeff();
      EXPECT_LT(error, 1e-9) << xi.transpose();
      EXPECT_NEAR(back.head<3>().norm(), xi.head<3>().norm(), 1e-7);
    } else {
      EXPECT_LT((back - xi).cwiseAbs().maxCoeff(), 1e-9) << xi.transpose();
    }
    EXPECT_LE(back.head<3>().norm(), M_PI + 1e-12);
  }
}

TEST(Se3, LogKeepsTheRelativeAccuracyOfTinyRotations) {
  for (const double angle : {1e-5, 1e-8, 1e-11, 1e-14}) {
    const Eigen::Vector3d w = angle * Eigen::Vector3d(1.0, 2.0, -2.0) / 3.0;
    EXPECT_LT((logSo3(expSo3(w)) - w).norm(), 1e-6 * angle) << angle;
  }
}

TEST(Se3, LeftJacobianIsTheDerivativeOfExp) {
  // Exp(w + d) = Exp(Jl(w) d) Exp(w) to first order in d.
  for (const Vector6d& xi : twists()) {
    const Eigen::Vector3d w = xi.head<3>();
    const Eigen::Matrix3d J = leftJacobianSo3(w);
    constexpr double kStep = 1e-5;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d d = kStep * Eigen::Vector3d::Unit(axis);
      const Eigen::Matrix3d forward = expSo3(w + d) * expSo3(w).transpose(),
                            backward = expSo3(w - d) * expSo3(w).transpose();
      const Eigen::Vector3d numeric = (logSo3(forward) - logSo3(backward)) / (2.0 * kStep);
      EXPECT_LT((J.col(axis) - numeric).norm(), 1e-8) << w.transpose();
    }
  }
}

TEST(Se3, AdjointMovesATwistThroughAPose) {
  const auto all = twists();
  for (std::size_t n = 0; n + 1 < all.size(); ++n) {
    const Eigen::Isometry3d T = expSe3(all[n]);
    const Vector6d xi = 0.1 * all[n + 1];
    const Eigen::Matrix4d moved = (T * expSe3(xi) * T.inverse()).matrix();
    EXPECT_LT((expSe3(adjoint(T) * xi).matrix() - moved).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(Se3, PoseErrorIsTheDistanceOfTheDifference) {
  const Eigen::Isometry3d T_a = expSe3((Vector6d() << 0.3, -0.2, 2.0, 1.0, 2.0, 3.0).finished());
  const Eigen::Isometry3d offset =
      expSe3((Vector6d() << 0.0, 0.25, 0.0, 0.0, 0.0, 0.0).finished()) * Eigen::Translation3d(0.3, 0.0, 0.4);
  const PoseError error = poseError(T_a, T_a * offset);
  EXPECT_NEAR(error.rotation, 0.25, 1e-12);
  EXPECT_NEAR(error.translation, 0.5, 1e-12);
  EXPECT_NEAR(poseError(T_a, T_a).rotation, 0.0, 1e-7);
  EXPECT_NEAR(poseError(T_a, T_a).translation, 0.0, 1e-15);
}

TEST(Se3, CovarianceOrderIsPinned) {
  // Library: [rotation; translation]. ROS: [x y z, roll pitch yaw].
  Matrix6d library;
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) library(row, column) = 10.0 * row + column;
  }
  const Matrix6d ros = swapCovarianceOrder(library);
  EXPECT_EQ(ros(0, 0), library(3, 3)) << "ROS starts with the variance of x";
  EXPECT_EQ(ros(3, 3), library(0, 0)) << "and ends with the rotations";
  EXPECT_EQ(ros(2, 4), library(5, 1)) << "z with pitch";
  EXPECT_EQ(ros(5, 0), library(2, 3)) << "yaw with x";
  EXPECT_EQ(swapCovarianceOrder(ros), library);
}

TEST(Se3, OrthonormalizedAcceptsTheDeviationsOfRealPoses) {
  const Eigen::Isometry3d truth = expSe3((Vector6d() << 0.4, -1.1, 0.7, 2.0, -3.0, 0.5).finished());
  std::mt19937 random(3);
  std::uniform_real_distribution<double> noise(-2e-4, 2e-4);  // |R R^T - I| up to 4e-4
  for (int n = 0; n < 100; ++n) {
    Eigen::Matrix4d matrix = truth.matrix();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) matrix(row, column) += noise(random);
    }
    const Eigen::Isometry3d T = orthonormalized(matrix);
    const Eigen::Matrix3d R = T.linear();
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_GT(R.determinant(), 0.0);
    EXPECT_LT(poseError(truth, T).rotation, 6e-4);
    EXPECT_EQ(T.translation(), Eigen::Vector3d(matrix.topRightCorner<3, 1>()));
    // Polar projection: no rotation is nearer. Any turned one must be further away.
    const double distance = (R - matrix.topLeftCorner<3, 3>()).norm();
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Matrix3d turned = expSo3(1e-4 * Eigen::Vector3d::Unit(axis)) * R;
      EXPECT_GT((turned - matrix.topLeftCorner<3, 3>()).norm(), distance);
    }
  }
}

TEST(Se3, OrthonormalizedRefusesWhatIsNoPose) {
  const Eigen::Matrix4d good = Eigen::Matrix4d::Identity();
  EXPECT_NO_THROW(orthonormalized(good));
  Eigen::Matrix4d mirrored = good;
  mirrored(0, 0) = -1.0;
  EXPECT_THROW(orthonormalized(mirrored), std::invalid_argument);
  EXPECT_THROW(orthonormalized(Eigen::Matrix4d::Zero()), std::invalid_argument);
  EXPECT_THROW(orthonormalized(2.0 * good), std::invalid_argument);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (int entry = 0; entry < 16; ++entry) {
      Eigen::Matrix4d matrix = good;
      matrix(entry / 4, entry % 4) = bad;
      EXPECT_THROW(orthonormalized(matrix), std::invalid_argument) << entry;
    }
  }
  Eigen::Matrix4d sheared = good;
  sheared(0, 1) = 0.1;
  EXPECT_THROW(orthonormalized(sheared), std::invalid_argument);
  EXPECT_NO_THROW(orthonormalized(sheared, 0.2));
  Eigen::Matrix4d projective = good;
  projective(3, 0) = 0.5;
  EXPECT_THROW(orthonormalized(projective), std::invalid_argument);
  projective = good;
  projective(3, 3) = 0.0;
  EXPECT_THROW(orthonormalized(projective), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
