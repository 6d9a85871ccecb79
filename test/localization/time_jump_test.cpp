// The clock goes back: a bag loops, a simulation starts again.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "../support/walk.h"

namespace ttsdf {
namespace {

using test::expectNear;
using test::guessAt;
using test::quickOptions;
using test::renderScan;
using test::Room;
using test::roomField;
using test::Tracking;

TEST(TimeJump, IsFollowedByTheStartOfTheBag) {
  Tracking t;
  for (int n = 0; n < 15; ++n, ++t.next) t.localizer.process(t.walk.scan(t.next));
  ASSERT_EQ(t.localizer.state(), LocalizerState::kTracking);
  t.localizer.timeJumpedBack();
  EXPECT_EQ(t.localizer.state(), LocalizerState::kRelocalizing);
  LocalizationUpdate update;
  for (int n = 0; n < 8; ++n) update = t.localizer.process(t.walk.scan(n));
  ASSERT_TRUE(update.pose_valid) << update.message;
  expectNear(update.T_map_base, t.walk.pose(0.7), 0.02, 0.01);
}

// The clock, the scans and the transforms show the same jump one after the other.
TEST(TimeJump, KeepsTheLastPoseWhenNoticedTwice) {
  Tracking t;
  ASSERT_EQ(t.localizer.state(), LocalizerState::kTracking);
  t.localizer.timeJumpedBack();
  t.localizer.timeJumpedBack();
  LocalizerScan covered = t.walk.scan(0);
  covered.points.resize(3, 0);
  const std::string message = t.localizer.process(covered).message;
  EXPECT_EQ(message.find("last pose before the time jump, test: "), 0U) << message;
}

/// A global localization that finds the scan's place.
void findGlobally(Localizer& localizer, const LocalizerScan& scan, const Eigen::Isometry3d& place) {
  GlobalJob job = localizer.beginGlobal(scan, std::nullopt);
  const PreparedMap map = Localizer::prepare(roomField(), localizer.options().registration);
  job.runWith([&](const ScanPoints& points, const auto&,
                  const auto&) { return map.registration->align(points, place); },
              {});
  localizer.applyGlobal(job);
}

void expectFoundAfterAJump(Tracking& t, const Eigen::Isometry3d& place) {
  LocalizationUpdate update = t.localizer.process(t.walk.scanAt(t.next++, place));
  ASSERT_EQ(t.localizer.state(), LocalizerState::kRelocalizing) << update.message;
  t.localizer.timeJumpedBack();
  for (int n = 0; n < 8; ++n) update = t.localizer.process(t.walk.scanAt(n, place));
  ASSERT_TRUE(update.pose_valid) << update.message;
  expectNear(update.T_map_base, place, 0.02, 0.01);
}

const Eigen::Isometry3d kElsewhere = test::cameraPose({3.4, 2.6, 1.3}, -2.2, 0.1);

TEST(TimeJump, KeepsAPlaceThatWasNotConfirmedYet) {
  Tracking t;
  t.localizer.reset();
  findGlobally(t.localizer, t.walk.scanAt(t.next++, kElsewhere), kElsewhere);
  expectFoundAfterAJump(t, kElsewhere);
}

// Carried elsewhere and found there; then the clock jumps before that is confirmed.
TEST(TimeJump, KeepsANewPlaceBesideTheLastGoodPose) {
  Tracking t;
  ASSERT_EQ(t.localizer.state(), LocalizerState::kTracking);
  findGlobally(t.localizer, t.walk.scanAt(t.next++, kElsewhere), kElsewhere);
  expectFoundAfterAJump(t, kElsewhere);
}

// Far from the start the search around the start pose may find a better score a metre off, which nobody
// meant.
TEST(TimeJump, GoesOnFromTheLastPoseFarFromTheStart) {
  Tracking t;
  for (int n = 0; n < 30; ++n, ++t.next) t.localizer.process(t.walk.scan(t.next));
  ASSERT_EQ(t.localizer.state(), LocalizerState::kTracking);
  const Eigen::Isometry3d place = t.walk.pose(0.1 * t.next);
  t.localizer.timeJumpedBack();
  LocalizationUpdate update;
  for (int n = 0; n < 8; ++n) update = t.localizer.process(t.walk.scanAt(n, place));
  ASSERT_TRUE(update.pose_valid) << update.message;
  expectNear(update.T_map_base, place, 0.02, 0.01);
}

/// Places on a way round the room, 3 degrees apart.
Eigen::Isometry3d placeOnCircle(int n) {
  const double turn = 2.0 * 3.14159265358979 * n / 120;
  return test::cameraPose({2.6 + 0.8 * std::cos(turn), 2.6 + 0.7 * std::sin(turn), 1.2}, turn + 1.5, 0.1);
}

/// Goes twice round the room and lets the clock jump now and then; the robot goes on as before.
void jumpOnTheWay(bool with_odometry) {
  const Eigen::Isometry3d T_odom_map = Eigen::Translation3d(0.3, -0.2, 0.0) * Eigen::Isometry3d::Identity();
  constexpr int kBetweenJumps = 11;
  Localizer localizer(quickOptions());
  localizer.setMap(roomField());
  localizer.setGuess(guessAt(placeOnCircle(0)));
  int valid = 0;
  for (int n = 0; n < 240; ++n) {
    if (n > 0 && n % kBetweenJumps == 0) {
      if (with_odometry) {
        EXPECT_EQ(localizer.state(), LocalizerState::kTracking) << "place " << n;
      }
      localizer.timeJumpedBack();
    }
    LocalizerScan scan;
    scan.stamp = 100.0 + 0.1 * (n % kBetweenJumps);
    scan.points = renderScan(Room(), placeOnCircle(n), 64, 48, 0.005, 1U + n);
    if (with_odometry) scan.T_odom_base = T_odom_map * placeOnCircle(n);
    const LocalizationUpdate update = localizer.process(scan);
    valid += update.pose_valid;
    if (update.pose_valid) expectNear(update.T_map_base, placeOnCircle(n), 0.05, 0.05);
  }
  EXPECT_GE(valid, with_odometry ? 120 : 60);  // confirming takes half of the time
}

// The start pose is searched around as well, where another wall fits as well as the right one.
TEST(TimeJump, NeverLeadsToAnotherPlaceWithOdometry) { jumpOnTheWay(true); }
TEST(TimeJump, NeverLeadsToAnotherPlaceWithoutOdometry) { jumpOnTheWay(false); }

}  // namespace
}  // namespace ttsdf
