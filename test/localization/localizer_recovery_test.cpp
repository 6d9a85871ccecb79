// Searches: from a start pose that is given, and back after the pose was lost.

#include <gtest/gtest.h>

#include <string>

#include "../support/walk.h"

namespace ttsdf {
namespace {

using test::cameraPose;
using test::expectNear;
using test::guessAt;
using test::quickOptions;
using test::roomField;
using test::Tracking;
using test::Walk;

TEST(LocalizerRecovery, RefinesHeightAndTiltOfAClickInRviz) {
  Walk walk;
  Localizer localizer(quickOptions());
  localizer.setMap(roomField());
  PoseGuess click = guessAt(walk.pose(0.0), 0.0, 0.0);
  click.T_map_base.translation() += Eigen::Vector3d(0.2, -0.2, -0.5);
  localizer.setGuess(click);
  LocalizationUpdate update;
  for (int n = 0; n < 12 && !update.pose_valid; ++n)
    update = localizer.process(walk.scanAt(n, walk.pose(0.0)));
  ASSERT_TRUE(update.pose_valid) << update.message;
  expectNear(update.T_map_base, walk.pose(0.0), 0.02, 0.01);
}

TEST(LocalizerRecovery, PublishesNoPoseBeforeASearchIsConfirmed) {
  LocalizerOptions options = quickOptions();
  options.recovery.confirmation_scans = 2;
  Walk walk;
  Localizer localizer(options);
  localizer.setMap(roomField());
  localizer.setGuess(guessAt(walk.pose(0.0)));
  EXPECT_FALSE(localizer.process(walk.scan(0)).pose_valid);
  EXPECT_FALSE(localizer.process(walk.scan(1)).pose_valid);
  EXPECT_EQ(localizer.state(), LocalizerState::kRelocalizing);
  EXPECT_TRUE(localizer.process(walk.scan(2)).pose_valid);
  EXPECT_EQ(localizer.state(), LocalizerState::kTracking);
}

TEST(LocalizerRecovery, DoesNotConfirmAPlaceThatMovesOtherwiseThanTheOdometry) {
  // A place that only looks alike: scans hold the pose found, while the robot drives on by 4 cm each.
  Localizer localizer(quickOptions());
  localizer.setMap(roomField());
  const Walk walk;
  PoseGuess guess = guessAt(walk.pose(0.0));
  guess.confirmation_seconds = 0.5;
  localizer.setGuess(guess);
  bool refused = false;
  for (int n = 0; n < 8; ++n) {
    LocalizerScan scan = walk.scanAt(n, walk.pose(0.0));
    scan.T_odom_base = expSe3((Vector6d() << 0, 0, 0, 0.04 * n, 0, 0).finished());
    const LocalizationUpdate update = localizer.process(scan);
    EXPECT_FALSE(update.pose_valid) << n << ": " << update.message;
    refused = refused || update.message.find("moved otherwise than the odometry") != std::string::npos;
  }
  EXPECT_TRUE(refused);
  // The same drive with scans that move along is confirmed.
  localizer.setGuess(guess);
  LocalizationUpdate last;
  for (int n = 10; n < 20; ++n) {
    LocalizerScan scan = walk.scan(n - 10);
    scan.stamp = walk.start + 0.1 * n;
    scan.T_odom_base = walk.pose(0.1 * (n - 10));
    last = localizer.process(scan);
  }
  EXPECT_EQ(last.state, LocalizerState::kTracking) << last.message;
}

TEST(LocalizerRecovery, APlaceFoundWithoutAPriorIsHeldToTheScoreItWasFoundBy) {
  // Every third point lies in free space: the other ones fit, in a wrong place they might as well.
  for (const double max_score : {1.0, 0.25}) {
    Localizer localizer(quickOptions());
    localizer.setMap(roomField());
    const Walk walk;
    PoseGuess guess = guessAt(walk.pose(0.0));
    guess.confirmation_seconds = 0.5;
    guess.max_score = max_score;
    localizer.setGuess(guess);
    bool published = false, refused = false;
    double worst = 0.0;
    for (int n = 0; n < 8; ++n) {
      LocalizerScan scan = walk.scanAt(n, walk.pose(0.0));
      for (Eigen::Index p = 0; n > 0 && p < scan.points.cols(); p += 3) scan.points.col(p) *= 0.6f;
      const LocalizationUpdate update = localizer.process(scan);
      published = published || update.pose_valid;
      refused = refused || update.message.find("max_score") != std::string::npos;
      worst = std::max(worst, update.registration.score);
    }
    EXPECT_GT(worst, 0.25);
    EXPECT_EQ(published, max_score == 1.0);
    EXPECT_EQ(refused, max_score < 1.0);
  }
}

TEST(LocalizerRecovery, GivesUpAWrongStartPose) {
  LocalizerOptions options = quickOptions();
  options.recovery.start_attempts = 3;
  options.recovery.search_period = 0.0;
  Walk walk;
  Localizer localizer(options);
  localizer.setMap(roomField());
  PoseGuess wrong = guessAt(cameraPose({5.0, 3.0, 0.4}, 3.5), 0.01, 0.01);
  wrong.widen = false;
  localizer.setGuess(wrong);
  for (int n = 0; n < 6; ++n) EXPECT_FALSE(localizer.process(walk.scan(n)).pose_valid);
  EXPECT_EQ(localizer.state(), LocalizerState::kWaitingForPose);
}

TEST(LocalizerRecovery, DegradesThenIsLostWhenTheCameraIsCarriedAway) {
  LocalizerOptions options = quickOptions();
  options.recovery.waiting_retry_seconds = 0.0;
  Tracking t(options);
  ASSERT_EQ(t.localizer.state(), LocalizerState::kTracking);
  const Eigen::Isometry3d T_elsewhere = cameraPose({4.8, 3.0, 1.5}, 3.6);
  bool degraded = false, lost = false;
  for (int n = 0; n < 10; ++n, ++t.next) {
    const LocalizationUpdate update = t.localizer.process(t.walk.scanAt(t.next, T_elsewhere));
    EXPECT_FALSE(update.pose_valid);
    degraded = degraded || update.state == LocalizerState::kDegraded;
    if (update.state == LocalizerState::kLost && !lost) {
      lost = true;
      EXPECT_FALSE(update.T_map_odom.has_value());
      EXPECT_FALSE(update.message.empty());
    }
  }
  EXPECT_TRUE(degraded);
  EXPECT_TRUE(lost);  // within one second
}

TEST(LocalizerRecovery, FindsItselfGloballyAfterItWasCarriedAway) {
  LocalizerOptions options;
  options.recovery.search_attempts = 0;
  options.global.starts = 3000;
  Tracking t(options);
  ASSERT_EQ(t.localizer.state(), LocalizerState::kTracking);
  const Eigen::Isometry3d T_elsewhere = cameraPose({3.5, 3.8, 1.4}, -1.2, 0.2);
  const Eigen::Vector3d gravity = T_elsewhere.linear().transpose() * Eigen::Vector3d(0, 0, -1);
  LocalizationUpdate update;
  int globals = 0;
  for (int n = 0; n < 60 && !update.pose_valid; ++n, ++t.next) {
    const LocalizerScan scan = t.walk.scanAt(t.next, T_elsewhere);
    update = t.localizer.process(scan);
    if (!update.wants_global) continue;
    ++globals;
    GlobalJob job = t.localizer.beginGlobal(scan, gravity);
    EXPECT_EQ(t.localizer.process(t.walk.scanAt(++t.next, T_elsewhere)).state, LocalizerState::kRelocalizing);
    job.run();
    t.localizer.applyGlobal(job);
  }
  ASSERT_TRUE(update.pose_valid) << update.message;
  EXPECT_GE(globals, 1);
  expectNear(update.T_map_base, T_elsewhere, 0.02, 0.01);
}

TEST(LocalizerRecovery, WaitsAfterItsGlobalAttemptsAreUsedUp) {
  LocalizerOptions options;
  options.recovery.search_attempts = 1;
  options.recovery.global_attempts = 2;
  options.recovery.global_retry_seconds = 0.2;
  options.recovery.waiting_retry_seconds = 0.0;
  Tracking t(options);
  const Eigen::Isometry3d T_elsewhere = cameraPose({4.8, 3.0, 1.5}, 3.6);
  int globals = 0;
  for (int n = 0; n < 60 && t.localizer.state() != LocalizerState::kWaitingForPose; ++n, ++t.next) {
    const LocalizerScan scan = t.walk.scanAt(t.next, T_elsewhere);
    if (!t.localizer.process(scan).wants_global) continue;
    ++globals;
    GlobalJob job = t.localizer.beginGlobal(scan, std::nullopt);
    job.run([](double) { return false; });
    const LocalizationUpdate update = t.localizer.applyGlobal(job);
    EXPECT_EQ(update.reason, RejectionReason::kCancelled);
  }
  EXPECT_EQ(t.localizer.state(), LocalizerState::kWaitingForPose);
  EXPECT_EQ(globals, 1);  // a cancelled one is not tried again
}

}  // namespace
}  // namespace ttsdf
