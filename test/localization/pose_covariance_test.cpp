#include "ttsdf_localization/localization/pose_covariance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace ttsdf {
namespace {

Matrix6d randomCovariance(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const Matrix6d A = Matrix6d::NullaryExpr([&]() { return normal(random); });
  return A * A.transpose() + 0.1 * Matrix6d::Identity();
}

TEST(MovedCovariance, AgreesWithSamplesOfARigidBody) {
  const Eigen::Vector3d offset(0.4, -1.2, 0.7);
  const Matrix6d covariance = 1e-4 * randomCovariance(1);
  const Matrix6d root = covariance.llt().matrixL();
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  Matrix6d sum = Matrix6d::Zero();
  const int n = 200000;
  for (int i = 0; i < n; ++i) {
    const Vector6d xi = root * Vector6d::NullaryExpr([&]() { return normal(random); });
    Vector6d moved;  // what the perturbation does to the pose of a frame at the other point
    moved << xi.head<3>(), xi.tail<3>() + (expSo3(xi.head<3>()) * offset - offset);
    sum += moved * moved.transpose();
  }
  const Matrix6d expected = sum / n;
  // Sampling error of a covariance entry: sqrt(2 / n) of the variances; five times that.
  const double tolerance = 5.0 * std::sqrt(2.0 / n) * expected.diagonal().maxCoeff();
  EXPECT_LT((movedCovariance(covariance, offset) - expected).cwiseAbs().maxCoeff(), tolerance);
}

TEST(MovedCovariance, ThereAndBackIsTheSame) {
  const Matrix6d covariance = randomCovariance(3);
  const Eigen::Vector3d offset(1.0, 2.0, 3.0);
  EXPECT_TRUE(movedCovariance(movedCovariance(covariance, offset), -offset).isApprox(covariance, 1e-12));
}

TEST(CovarianceBoundedBy, KeepsAMeasurementThatIsSurerThanThePrior) {
  const Matrix6d measured = randomCovariance(4);
  EXPECT_TRUE(covarianceBoundedBy(measured, measured + randomCovariance(5)).isApprox(measured, 1e-9));
  EXPECT_TRUE(covarianceBoundedBy(measured + randomCovariance(5), measured).isApprox(measured, 1e-9));
}

TEST(CovarianceBoundedBy, PutsThePriorWhereTheScanSaysNothing) {
  // A corridor along a slanted direction: everything is known to a millimetre but the way along it.
  const Eigen::Vector3d along = Eigen::Vector3d(1.0, 2.0, 0.5).normalized();
  Matrix6d measured = isotropicCovariance(1e-3, 1e-3);
  measured.bottomRightCorner<3, 3>() += along * along.transpose();
  const Matrix6d prior = isotropicCovariance(0.01, 0.02);
  const Matrix6d fused = covarianceBoundedBy(measured, prior);
  EXPECT_NEAR(along.dot(fused.bottomRightCorner<3, 3>() * along), 0.02 * 0.02, 1e-9);
  const Eigen::Vector3d across = along.unitOrthogonal();
  EXPECT_NEAR(across.dot(fused.bottomRightCorner<3, 3>() * across), 1e-6, 1e-9);
  EXPECT_TRUE(isCovariance(fused));
}

TEST(CovarianceBoundedBy, DoesNotDependOnThePoint) {
  Matrix6d measured = isotropicCovariance(1e-3, 1e-3);
  measured(3, 3) += 1.0;
  const Matrix6d prior = 1e-4 * randomCovariance(6);
  const Eigen::Vector3d offset(0.3, -2.0, 1.0);
  const Matrix6d here = movedCovariance(covarianceBoundedBy(measured, prior), offset);
  const Matrix6d there =
      covarianceBoundedBy(movedCovariance(measured, offset), movedCovariance(prior, offset));
  EXPECT_TRUE(here.isApprox(there, 1e-6));
}

TEST(IsCovariance, RefusesWhatIsNone) {
  EXPECT_TRUE(isCovariance(Matrix6d::Zero()));
  EXPECT_TRUE(isCovariance(randomCovariance(7)));
  Matrix6d bad = Matrix6d::Identity();
  bad(2, 2) = -1.0;
  EXPECT_FALSE(isCovariance(bad));
  bad = Matrix6d::Identity();
  bad(0, 1) = 0.5;
  EXPECT_FALSE(isCovariance(bad));
  bad = Matrix6d::Identity();
  bad(5, 5) = std::nan("");
  EXPECT_FALSE(isCovariance(bad));
}

TEST(InflatedToInclude, ContradictionBeyondChanceLowersTheTrustInThePrior) {
  PoseEstimate prior;
  prior.covariance = isotropicCovariance(0.001, 0.001);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().x() = 0.2;  // wheels slipped
  const PoseEstimate wide = inflatedToInclude(prior, T);
  EXPECT_NEAR(0.2 * 0.2 * wide.covariance.inverse()(3, 3), 22.5, 1e-6);
  EXPECT_NEAR(wide.covariance(4, 4), prior.covariance(4, 4), 1e-12);  // only where they contradict
  T.translation().x() = 0.004;
  EXPECT_TRUE(inflatedToInclude(prior, T).covariance.isApprox(prior.covariance, 1e-15));
}

}  // namespace
}  // namespace ttsdf
