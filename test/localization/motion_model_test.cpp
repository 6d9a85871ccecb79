#include "ttsdf_localization/localization/motion_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "ttsdf_localization/localization/pose_covariance.h"

namespace ttsdf {
namespace {

Vector6d twist(double wx, double wy, double wz, double x, double y, double z) {
  Vector6d xi;
  xi << wx, wy, wz, x, y, z;
  return xi;
}

LocalizerScan scanAt(double stamp) {
  LocalizerScan scan;
  scan.stamp = stamp;
  return scan;
}

TEST(MotionModel, KnowsNothingWithoutAPose) { EXPECT_FALSE(MotionModel().predict(scanAt(1.0)).has_value()); }

TEST(MotionModel, AddsTheMotionOfTheOdometry) {
  MotionModel model;
  const Eigen::Isometry3d T_map_odom = expSe3(twist(0.1, -0.2, 0.5, 3.0, 1.0, 0.2));
  LocalizerScan first = scanAt(1.0), second = scanAt(1.1);
  first.T_odom_base = expSe3(twist(0.0, 0.0, 0.3, 1.0, 0.0, 0.0));
  second.T_odom_base = expSe3(twist(0.0, 0.1, 0.4, 1.2, 0.1, 0.0));
  model.setPose(first, T_map_odom * *first.T_odom_base, Matrix6d::Zero());
  const auto prediction = model.predict(second);
  ASSERT_TRUE(prediction);
  EXPECT_TRUE(prediction->T_map_base.isApprox(T_map_odom * *second.T_odom_base, 1e-12));
  ASSERT_TRUE(model.correction());
  EXPECT_TRUE(model.correction()->isApprox(T_map_odom, 1e-12));
}

TEST(MotionModel, GrowsTheCovarianceWithTheDistanceDriven) {
  MotionOptions options;
  options.odometry_translation_noise = 0.1;
  MotionModel model(options);
  LocalizerScan first = scanAt(1.0), second = scanAt(1.1);
  first.T_odom_base = Eigen::Isometry3d::Identity();
  second.T_odom_base = expSe3(twist(0.0, 0.0, 0.0, 2.0, 0.0, 0.0));
  model.setPose(first, Eigen::Isometry3d::Identity(), isotropicCovariance(0.0, 0.3));
  EXPECT_NEAR(model.predict(second)->covariance(3, 3), 0.3 * 0.3 + 0.2 * 0.2, 1e-12);
}

TEST(MotionModel, CarriesAConstantVelocityOnAlongAnArc) {
  MotionModel model;
  const Vector6d velocity = twist(0.0, 0.0, 0.8, 1.0, 0.0, 0.0);
  model.setPose(scanAt(0.0), Eigen::Isometry3d::Identity(), Matrix6d::Zero());
  model.correct(scanAt(0.1), expSe3(0.1 * velocity), Matrix6d::Zero());
  EXPECT_TRUE(model.twist().isApprox(velocity, 1e-9));
  EXPECT_TRUE(model.predict(scanAt(0.2))->T_map_base.isApprox(expSe3(0.2 * velocity), 1e-9));
}

// Constant acceleration a: the mean velocity over an interval I is off by a I / 2 at its end, and the
// position t later by a t (t + I) / 2.
TEST(MotionModel, IsOffByWhatTheAccelerationDoes) {
  MotionOptions options;
  options.acceleration = 2.0, options.angular_acceleration = 3.0;
  const double interval = 0.1, t = 0.05;
  const auto position = [&](double time) { return 0.5 * options.acceleration * time * time; };
  MotionModel model(options);
  const auto at = [&](double x) { return expSe3(twist(0.0, 0.0, 0.0, x, 0.0, 0.0)); };
  model.setPose(scanAt(0.0), at(position(0.0)), Matrix6d::Zero());
  model.correct(scanAt(interval), at(position(interval)), Matrix6d::Zero());
  const auto prediction = model.predict(scanAt(interval + t));
  const double off = position(interval + t) - prediction->T_map_base.translation().x();
  EXPECT_NEAR(std::sqrt(prediction->covariance(3, 3)), off, 1e-12);
  EXPECT_NEAR(std::sqrt(prediction->covariance(0, 0)), off * 3.0 / 2.0, 1e-12);
}

TEST(MotionModel, IsNoLessCertainThanTheSpeedAllows) {
  MotionOptions options;
  options.velocity_translation_noise = 0.5, options.acceleration = 1000.0;
  MotionModel model(options);
  model.setPose(scanAt(0.0), Eigen::Isometry3d::Identity(), Matrix6d::Zero());
  EXPECT_NEAR(std::sqrt(model.predict(scanAt(0.2))->covariance(3, 3)), 0.1, 1e-12);
  model.correct(scanAt(0.1), Eigen::Isometry3d::Identity(), Matrix6d::Zero());
  EXPECT_NEAR(std::sqrt(model.predict(scanAt(0.3))->covariance(3, 3)), 0.1, 1e-12);
}

/// Still, then 0.3 m off at the next scan: where 0.05 m in each direction were expected.
MotionModel afterAJolt(bool measured = true) {
  MotionOptions options;
  options.velocity_translation_noise = 0.5, options.acceleration = 1000.0;
  MotionModel model(options);
  model.setPose(scanAt(0.0), Eigen::Isometry3d::Identity(), Matrix6d::Zero());
  model.correct(scanAt(0.1), Eigen::Isometry3d::Identity(), Matrix6d::Zero());
  model.correct(scanAt(0.2), expSe3(twist(0.0, 0.0, 0.0, 0.3, 0.0, 0.0)), Matrix6d::Zero(), measured);
  return model;
}

// The next guess expects as much: 0.3 m in all, sqrt(3) less in each direction.
TEST(MotionModel, ExpectsMotionAsUnsteadyAsItHasSeen) {
  const auto prediction = afterAJolt().predict(scanAt(0.3));
  EXPECT_NEAR(std::sqrt(prediction->covariance(3, 3)), 0.3 / std::sqrt(3.0), 1e-9);
  EXPECT_NEAR(std::sqrt(prediction->covariance(0, 0)), 0.05, 1e-9);  // it has not turned
}

TEST(MotionModel, ForgetsUnsteadyMotion) {
  MotionModel model = afterAJolt();
  double x = 0.3;
  for (int n = 3; n <= 202; ++n)
    model.correct(scanAt(0.1 * n), expSe3(twist(0.0, 0.0, 0.0, x += 0.3, 0.0, 0.0)), Matrix6d::Zero());
  EXPECT_NEAR(std::sqrt(model.predict(scanAt(20.3))->covariance(3, 3)), 0.05, 0.0005);
}

// A search puts the pose right by 5 m: no camera moves like that.
TEST(MotionModel, ExpectsNoMotionAsLargeAsACorrection) {
  MotionModel model = afterAJolt();
  model.correct(scanAt(0.3), expSe3(twist(0.0, 0.0, 0.0, 5.0, 0.0, 0.0)), Matrix6d::Zero());
  EXPECT_LE(std::sqrt(model.predict(scanAt(0.4))->covariance(3, 3)), 10.0 * 0.05 + 1e-9);
}

// The velocity is that of the odometry's last step, however long scans have fixed nothing.
TEST(MotionModel, VelocityOfOdometryIsOfItsLastStep) {
  MotionOptions options;
  options.prior = "velocity";
  const auto after = [&](bool measured) {
    MotionModel model(options);
    LocalizerScan scan = scanAt(0.0);
    scan.T_odom_base = Eigen::Isometry3d::Identity();
    model.setPose(scan, Eigen::Isometry3d::Identity(), Matrix6d::Zero());
    for (int n = 1; n <= 10; ++n) {
      scan = scanAt(0.1 * n);
      scan.T_odom_base = expSe3(twist(0.0, 0.0, 0.0, 0.1 * n, 0.0, 0.0));
      model.correct(scan, *scan.T_odom_base, Matrix6d::Zero(), measured || n == 10);
    }
    return model.predict(scanAt(1.1))->covariance(3, 3);
  };
  EXPECT_NEAR(after(false), after(true), 1e-12);
}

TEST(MotionModel, LearnsNothingFromPosesThatAreGuessedThemselves) {
  MotionModel model = afterAJolt(false);
  EXPECT_NEAR(std::sqrt(model.predict(scanAt(0.3))->covariance(3, 3)), 0.5 * 0.2, 1e-9);
}

TEST(MotionModel, StopsExtrapolatingAfterItsTime) {
  MotionOptions options;
  options.max_extrapolation = 0.5;
  MotionModel model(options);
  const Vector6d velocity = twist(0.0, 0.0, 0.0, 1.0, 0.0, 0.0);
  model.setPose(scanAt(0.0), Eigen::Isometry3d::Identity(), Matrix6d::Zero());
  model.correct(scanAt(0.1), expSe3(0.1 * velocity), Matrix6d::Zero());
  EXPECT_NEAR(model.predict(scanAt(60.0))->T_map_base.translation().x(), 0.6, 1e-9);
}

TEST(MotionModel, FallsBackOnVelocityWhileOdometryIsMissing) {
  MotionModel model;
  LocalizerScan first = scanAt(0.0), second = scanAt(0.1);
  first.T_odom_base = Eigen::Isometry3d::Identity();
  second.T_odom_base = expSe3(twist(0.0, 0.0, 0.0, 0.1, 0.0, 0.0));
  model.setPose(first, Eigen::Isometry3d::Identity(), Matrix6d::Zero());
  model.correct(second, *second.T_odom_base, Matrix6d::Zero());
  EXPECT_NEAR(model.predict(scanAt(0.2))->T_map_base.translation().x(), 0.2, 1e-9);
  EXPECT_TRUE(model.correction().has_value());
}

TEST(MotionModel, TakesTheExternalPriorOnlyWhenAsked) {
  MotionOptions options;
  options.prior = "external";
  MotionModel model(options);
  EXPECT_FALSE(model.predict(scanAt(0.0)));
  LocalizerScan scan = scanAt(0.1);
  scan.T_map_base_prior = expSe3(twist(0.0, 0.0, 0.0, 7.0, 0.0, 0.0));
  EXPECT_NEAR(model.predict(scan)->T_map_base.translation().x(), 7.0, 1e-12);
}

TEST(MotionModel, IntegratesTheMotionSinceAGuess) {
  PoseGuess guess;
  guess.T_map_base = expSe3(twist(0.0, 0.0, 1.0, 2.0, 0.0, 0.0));
  guess.stamp = 1.0;
  guess.T_odom_base = Eigen::Isometry3d::Identity();
  LocalizerScan scan = scanAt(9.0);
  scan.T_odom_base = expSe3(twist(0.0, 0.0, 0.0, 3.0, 0.0, 0.0));
  EXPECT_TRUE(
      MotionModel().predict(guess, scan).T_map_base.isApprox(guess.T_map_base * *scan.T_odom_base, 1e-12));
}

TEST(MotionModel, WidensAGuessByTimeWhereOdometryIsMissing) {
  MotionOptions options;
  options.velocity_translation_noise = 0.5;
  PoseGuess guess;
  guess.stamp = 1.0;
  EXPECT_NEAR(MotionModel(options).predict(guess, scanAt(3.0)).covariance(4, 4), 1.0, 1e-12);
  guess.stamp = std::numeric_limits<double>::quiet_NaN();  // "at the next scan"
  EXPECT_EQ(MotionModel(options).predict(guess, scanAt(3.0)).covariance(4, 4), 0.0);
}

}  // namespace
}  // namespace ttsdf
