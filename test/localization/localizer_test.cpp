#include "ttsdf_localization/localization/localizer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "../support/walk.h"

namespace ttsdf {
namespace {

using test::cameraPose;
using test::expectNear;
using test::guessAt;
using test::quickOptions;
using test::renderScan;
using test::roomField;
using test::Tracking;
using test::Walk;

TEST(Localizer, HasNoPoseWithoutAMap) {
  Localizer localizer(quickOptions());
  const LocalizationUpdate update = localizer.process(Walk().scan(0));
  EXPECT_EQ(update.state, LocalizerState::kNoMap);
  EXPECT_EQ(update.reason, RejectionReason::kNoMap);
  EXPECT_FALSE(update.pose_valid);
}

TEST(Localizer, WaitsForAPoseWithAMap) {
  Localizer localizer(quickOptions());
  localizer.setMap(roomField());
  const LocalizationUpdate update = localizer.process(Walk().scan(0));
  EXPECT_EQ(update.state, LocalizerState::kWaitingForPose);
  EXPECT_FALSE(update.pose_valid);
  EXPECT_FALSE(update.wants_global);
}

TEST(Localizer, KeepsAGuessUntilTheMapComes) {
  Walk walk;
  Localizer localizer(quickOptions());
  localizer.setGuess(guessAt(walk.pose(0.0)));
  EXPECT_EQ(localizer.process(walk.scan(0)).state, LocalizerState::kNoMap);
  localizer.setMap(roomField());
  for (int n = 1; n < 6; ++n) localizer.process(walk.scan(n));
  EXPECT_EQ(localizer.state(), LocalizerState::kTracking);
}

TEST(Localizer, TracksWithoutOdometry) {
  Tracking t;
  ASSERT_EQ(t.localizer.state(), LocalizerState::kTracking);
  for (int n = 0; n < 20; ++n, ++t.next) {
    const LocalizationUpdate update = t.localizer.process(t.walk.scan(t.next));
    ASSERT_TRUE(update.pose_valid) << update.message;
    expectNear(update.T_map_base, t.walk.pose(0.1 * t.next), 0.02, 0.01);
    EXPECT_FALSE(update.T_map_odom.has_value());
  }
}

TEST(Localizer, CorrectsDriftingOdometry) {
  Walk walk;
  Localizer localizer(quickOptions());
  localizer.setMap(roomField());
  localizer.setGuess(guessAt(walk.pose(0.0)));
  const Eigen::Isometry3d T_base_sensor = cameraPose({0.2, 0.0, 1.2}, 0.0);
  int tracked = 0;
  for (int n = 0; n < 25; ++n) {
    LocalizerScan scan = walk.scan(n);
    const Eigen::Isometry3d T_map_base = walk.pose(0.1 * n) * T_base_sensor.inverse();
    Vector6d drift;
    drift << 0.0, 0.0, 0.002 * n, 0.01 * n, -0.005 * n, 0.0;
    scan.T_base_sensor = T_base_sensor;
    scan.T_odom_base = expSe3(drift) * T_map_base;
    if (n == 0) localizer.setGuess(guessAt(T_map_base));
    const LocalizationUpdate update = localizer.process(scan);
    if (!update.pose_valid) continue;
    ++tracked;
    expectNear(update.T_map_base, T_map_base, 0.03, 0.015);
    ASSERT_TRUE(update.T_map_odom.has_value());
    expectNear(*update.T_map_odom * *scan.T_odom_base, T_map_base, 0.03, 0.015);
  }
  EXPECT_GE(tracked, 20);
}

TEST(Localizer, CoastsOnOdometryWhileTheCameraIsCovered) {
  LocalizerOptions options = quickOptions();
  options.recovery.coast_seconds = 3.0;
  Walk walk;
  Localizer localizer(options);
  localizer.setMap(roomField());
  localizer.setGuess(guessAt(walk.pose(0.0)));
  LocalizationUpdate update;
  for (int n = 0; n < 30; ++n) {
    LocalizerScan scan = walk.scan(n);
    scan.T_odom_base = walk.pose(0.1 * n);
    if (n >= 5 && n < 25) scan.points.resize(3, 0);
    update = localizer.process(scan);
    if (n >= 5 && n < 25) {
      EXPECT_EQ(update.state, LocalizerState::kDegraded);
      EXPECT_EQ(update.reason, RejectionReason::kTooFewPoints);
      EXPECT_TRUE(update.T_map_odom.has_value());
    }
  }
  EXPECT_EQ(update.state, LocalizerState::kTracking);
  expectNear(update.T_map_base, walk.pose(2.9), 0.02, 0.01);
}

/// A box as wide as `share` of the picture, 0.8 m before the camera.
ScanPoints withPeople(ScanPoints points, double share, int n) {
  const int width = 64, box = static_cast<int>(share * width), left = (5 * n) % (width - box);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const int u = static_cast<int>(i) % width;
    if (u >= left && u < left + box && points(2, i) > 0.8f) points.col(i) *= 0.8f / points(2, i);
  }
  return points;
}

TEST(Localizer, IsNotPulledAwayByPeopleBeforeTheMap) {
  Tracking t;
  for (int n = 0; n < 20; ++n, ++t.next) {
    LocalizerScan scan = t.walk.scan(t.next);
    scan.points = withPeople(std::move(scan.points), 0.3, n);
    const LocalizationUpdate update = t.localizer.process(scan);
    ASSERT_TRUE(update.pose_valid) << n << ": " << update.message;
    expectNear(update.T_map_base, t.walk.pose(0.1 * t.next), 0.03, 0.015);
  }
}

TEST(Localizer, LosesTheCoveredCameraWithoutOdometry) {
  Tracking t;
  LocalizerScan covered = t.walk.scan(0);
  covered.points.resize(3, 0);
  for (int n = 0; n < 10; ++n) {
    covered.stamp = t.walk.start + 0.1 * t.next++;
    t.localizer.process(covered);
  }
  EXPECT_EQ(t.localizer.state(), LocalizerState::kLost);
}

TEST(Localizer, SkipsScansThatAreNotNewer) {
  Tracking t;
  const LocalizationUpdate update = t.localizer.process(t.walk.scan(t.next - 1));
  EXPECT_EQ(update.reason, RejectionReason::kOldStamp);
  EXPECT_FALSE(update.pose_valid);
  LocalizerScan scan = t.walk.scan(t.next);
  scan.stamp = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(t.localizer.process(scan).reason, RejectionReason::kOldStamp);
  EXPECT_EQ(t.localizer.state(), LocalizerState::kTracking);
}

TEST(Localizer, KeepsThePoseWhenTheMapIsReplaced) {
  Tracking t;
  t.localizer.setMap(roomField());
  EXPECT_TRUE(t.localizer.process(t.walk.scan(t.next)).pose_valid);
}

TEST(Localizer, ForgetsThePoseOnReset) {
  Tracking t;
  EXPECT_TRUE(t.localizer.lastPose().has_value());
  t.localizer.reset();
  EXPECT_FALSE(t.localizer.lastPose().has_value());
  EXPECT_EQ(t.localizer.process(t.walk.scan(0)).state, LocalizerState::kWaitingForPose);
}

TEST(Localizer, SurvivesBadPoints) {
  Tracking t;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const float value : {nan, 1e9f, 1e30f, std::numeric_limits<float>::infinity(), 0.0f}) {
    LocalizerScan scan = t.walk.scan(t.next++);
    scan.points.setConstant(value);
    EXPECT_FALSE(t.localizer.process(scan).pose_valid) << value;
  }
  // Half a second of guessing without odometry: the next scans confirm the pose.
  LocalizationUpdate update;
  for (int n = 0; n < 7; ++n) update = t.localizer.process(t.walk.scan(t.next++));
  EXPECT_TRUE(update.pose_valid) << update.message;
}

/// An endless corridor along x, 2 m wide and 2.5 m high: nothing tells where along it the camera is.
struct Corridor {
  Eigen::Vector3d size{8.0, 2.0, 2.5};
  double distance(const Eigen::Vector3d& p) const {
    return std::min({p.y(), size.y() - p.y(), p.z(), size.z() - p.z()});
  }
};

TEST(Localizer, KeepsThePriorAlongACorridorAndSaysSo) {
  GridGeometry geometry;
  DenseTensor tensor = test::sampleScene(Corridor(), 0.05, geometry);
  Localizer localizer(quickOptions());
  localizer.setMap(std::make_shared<DenseDistanceField>(std::move(tensor), geometry));
  const auto pose = [](int n) { return cameraPose({2.0 + 0.05 * n, 1.0, 1.2}, 0.1); };
  LocalizationUpdate update;
  double last_sigma = 0.0;
  PoseGuess start = guessAt(pose(0), 0.01, 0.01);
  start.widen = false;
  localizer.setGuess(start);
  double offset = 0.0;
  for (int n = 0; n < 20; ++n) {
    LocalizerScan scan;
    scan.stamp = 0.1 * n;
    const ScanPoints points = renderScan(Corridor(), pose(n));
    scan.points =
        points.array().rowwise() / (points.colwise().norm().array() < 4.0f).cast<float>();  // range 4 m
    scan.T_odom_base = pose(n);
    update = localizer.process(scan);
    if (!update.pose_valid) continue;
    EXPECT_GE(update.registration.degenerate_directions, 1);
    const double error = (update.T_map_base.translation() - pose(n).translation()).x();
    if (offset == 0.0) offset = error;
    EXPECT_NEAR(error, offset, 0.02);  // no slide: the odometry is exact
    const double sigma = std::sqrt(update.covariance(3, 3));
    EXPECT_GT(sigma, last_sigma);  // and less and less is known
    EXPECT_GT(sigma, 3.0 * std::sqrt(update.covariance(4, 4)));
    last_sigma = sigma;
  }
  EXPECT_TRUE(update.pose_valid) << update.message;
}

// Of floor and ceiling little is seen, so noise moves the best fit up and down: the prior keeps the robot
// where it is.
TEST(Localizer, NoiseAlongDirectionsThatTheScanHardlyFixesIsNoJump) {
  constexpr double kGate = 0.02;
  GridGeometry geometry;
  DenseTensor tensor = test::sampleScene(Corridor(), 0.05, geometry);
  LocalizerOptions options = quickOptions();
  Localizer localizer(options);
  localizer.setMap(std::make_shared<DenseDistanceField>(std::move(tensor), geometry));
  const auto pose = [](int n) { return cameraPose({2.0 + 0.05 * n, 1.0, 1.2}, 0.1); };
  PoseGuess start = guessAt(pose(0), 0.01, 0.01);
  start.widen = false;
  localizer.setGuess(start);
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0.0F, 0.03F);
  double slide = 0.0;
  for (int n = 0; n < 30; ++n) {
    if (n == 10) {
      options.gates.max_jump_translation = kGate;
      localizer.setOptions(options);
    }
    LocalizerScan scan;
    scan.stamp = 0.1 * n;
    const ScanPoints points = renderScan(Corridor(), pose(n));
    scan.points = points.array().rowwise() / (points.colwise().norm().array() < 4.0f).cast<float>();
    for (Eigen::Index k = 0; k < scan.points.cols(); ++k) scan.points.col(k) *= 1.0F + noise(random);
    scan.T_odom_base = pose(n);
    const LocalizationUpdate update = localizer.process(scan);
    if (n < 10) continue;
    EXPECT_TRUE(update.pose_valid) << update.message;
    EXPECT_LT(update.jump_translation, kGate);
    slide = std::max(slide, poseError(pose(n), update.registration.T_map_sensor).translation);
  }
  EXPECT_LT(slide, kGate);
}

TEST(Localizer, RefusesOptionsOutOfRange) {
  LocalizerOptions options;
  options.gates.min_inlier_ratio = 2.0;
  try {
    Localizer localizer(options);
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("min_inlier_ratio"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("gates"), std::string::npos);
  }
}

}  // namespace
}  // namespace ttsdf
