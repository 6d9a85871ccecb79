// A camera in the hand, without odometry: a pose that is published is right, however it moves.

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "../support/walk.h"

namespace ttsdf {
namespace {

/// Goes round the middle of the room, looks about and stops by turns; `speed` stretches time.
Eigen::Isometry3d handPose(double t) {
  const double swing = std::sin(0.9 * t) + 0.4 * std::sin(2.3 * t + 1.0);
  return test::cameraPose(
      {2.6 + 0.7 * std::cos(0.5 * t), 2.2 + 0.6 * std::sin(0.7 * t), 1.3 + 0.2 * std::sin(1.1 * t)},
      0.8 * t + 0.5 * swing, 0.2 + 0.15 * std::sin(1.7 * t));
}

struct Motion {
  double rate, speed;
};
void PrintTo(const Motion& m, std::ostream* out) { *out << m.rate << " Hz, " << m.speed << " times as fast"; }

class HandheldMotion : public ::testing::TestWithParam<Motion> {};

TEST_P(HandheldMotion, NoPosePublishedAsGoodIsWrong) {
  Localizer localizer(test::quickOptions());
  localizer.setMap(test::roomField());
  localizer.setGuess(test::guessAt(handPose(0.0)));
  const int scans = 60;
  int published = 0;
  for (int n = 0; n < scans; ++n) {
    LocalizerScan scan;
    scan.stamp = 100.0 + n / GetParam().rate;
    const Eigen::Isometry3d truth = handPose(GetParam().speed * n / GetParam().rate);
    scan.points = test::renderScan(test::Room(), truth);
    const LocalizationUpdate update = localizer.process(scan);
    if (update.pose_valid) {
      ++published;
      EXPECT_LT(poseError(truth, update.T_map_base).translation, 0.1) << "scan " << n;
      continue;
    }
    EXPECT_NE(update.state, LocalizerState::kTracking) << "scan " << n;
  }
  RecordProperty("published", published);
  if (GetParam().speed > 1.0) return;
  EXPECT_GE(published, 3 * scans / 5);  // at times it looks at one wall
}

// A start pose before a bare wall, four scans a second: it is kept until the camera turns.
TEST(Handheld, AStartPoseBeforeAWallIsNotThrownAway) {
  Localizer localizer(test::quickOptions());
  localizer.setMap(test::roomField());
  const PoseGuess guess = test::guessAt(test::cameraPose({2.4, 0.7, 1.5}, -M_PI / 2.0));
  localizer.setGuess(guess);
  for (int n = 0; n < 10; ++n) {
    LocalizerScan scan;
    scan.stamp = 100.0 + 0.25 * n;
    scan.points = test::renderScan(test::Room(), guess.T_map_base);
    EXPECT_GT(localizer.process(scan).registration.degenerate_directions, 0) << "scan " << n;
    EXPECT_NE(localizer.state(), LocalizerState::kLost) << "scan " << n;
  }
}

/// A passage along x. Its wall y = 0: boxes of their own, then 5 m of nothing, then posts that are all alike.
struct Colonnade {
  Eigen::Vector3d size{16.0, 2.5, 2.5};
  double distance(const Eigen::Vector3d& p) const {
    double d = std::min({p.y(), size.y() - p.y(), p.z(), size.z() - p.z()});
    for (const Eigen::Vector3d& box :
         {Eigen::Vector3d(0.6, 0.0, 1.4), {1.5, 0.0, 0.9}, {2.6, 0.0, 1.7}, {3.6, 0.0, 1.2}})
      d = std::min(d, test::boxDistance(p, box, {0.2, 0.25, 0.2}));
    for (double x = 8.0; x < 16.0; x += 1.0)
      d = std::min(d, test::boxDistance(p, {x, 0.0, 1.25}, {0.1, 0.2, 2.0}));
    return d;
  }
};

std::shared_ptr<const DistanceField> colonnadeField() {
  GridGeometry geometry;
  DenseTensor tensor = test::sampleScene(Colonnade(), 0.05, geometry);
  return std::make_shared<DenseDistanceField>(std::move(tensor), geometry);
}

// Along the bare wall the camera slows down, which nothing shows: it then stands before another post than was
// guessed.
class SlowsDown : public ::testing::TestWithParam<double> {};

TEST_P(SlowsDown, AndIsNotTakenToBeAtAnotherPost) {
  Localizer localizer(test::quickOptions());
  localizer.setMap(colonnadeField());
  const auto pose = [](double t) {  // speeds up, goes 2 m/s, slows down
    const double started = std::min(t, 0.5), fast = std::clamp(t - 0.5, 0.0, 1.85),
                 slow = std::max(0.0, t - 2.35);
    const double x = 1.0 + 2.0 * started * started + 2.0 * fast + GetParam() * slow;
    return test::cameraPose({x, 1.8, 1.4}, -M_PI / 2.0, 0.5);  // the floor is seen, too
  };
  localizer.setGuess(test::guessAt(pose(0.0)));
  int published = 0, guessed = 0, returns = 0;
  double returned = 0.0;  // stamp of the first scan since the last guess that fixes the pose
  for (int n = 0; n < 110; ++n) {
    LocalizerScan scan;
    const double t = n / 15.0;
    scan.stamp = 100.0 + t;
    scan.points = test::renderScan(Colonnade(), pose(t));
    const LocalizationUpdate update = localizer.process(scan);
    if (update.registration.degenerate_directions > 0) returned = 0.0;
    if (returned == 0.0 && update.registration.degenerate_directions == 0) returned = scan.stamp;
    if (!update.pose_valid) {
      guessed += update.registration.degenerate_directions > 0 ? 1 : 0;
      continue;
    }
    if (guessed > 10) {
      EXPECT_GE(scan.stamp - returned, localizer.options().recovery.confirmation_seconds - 0.01);
      ++returns;
    }
    guessed = 0;
    ++published;
    EXPECT_LT(poseError(pose(t), update.T_map_base).translation, 0.1) << "scan " << n;
  }
  EXPECT_GE(published, 25);
  // Slower than that the guess is off by more than two standard deviations: then it may be lost.
  if (GetParam() > 1.0) {
    EXPECT_GE(returns, 1);
  }
}

// A hand before the lens, or images that are lost, while the camera goes along posts and slows down.
class SeesNothing : public ::testing::TestWithParam<std::tuple<double, double, bool>> {};

TEST_P(SeesNothing, AndIsNotTakenToBeAtAnotherPost) {
  const auto [seconds, slow_speed, lost_images] = GetParam();
  Localizer localizer(test::quickOptions());
  localizer.setMap(colonnadeField());
  constexpr double kCovered = 1.2;  // from then on nothing is seen, and it brakes [s]
  const auto pose = [&, slow = slow_speed](double t) {
    constexpr double kBrake = 6.0;  // [m/s^2]
    const double since = std::max(0.0, t - kCovered), braked = std::min(since, (2.0 - slow) / kBrake);
    const double x = 8.2 + 2.0 * (std::min(t, kCovered) + braked) - 0.5 * kBrake * braked * braked +
                     slow * (since - braked);
    return test::cameraPose({x, 1.8, 1.4}, -M_PI / 2.0, 0.5);
  };
  localizer.setGuess(test::guessAt(pose(0.0)));
  int before = 0;
  for (int n = 0; n < 60; ++n) {
    LocalizerScan scan;
    const double t = n / 15.0;
    const bool covered = t > kCovered && t < kCovered + seconds;
    scan.stamp = 100.0 + t;
    scan.points = covered ? Eigen::Matrix3Xf(3, 0) : test::renderScan(Colonnade(), pose(t));
    if (covered && lost_images) {
      localizer.withoutScans(t - kCovered, 1.0 / 15.0);
      continue;
    }
    const LocalizationUpdate update = localizer.process(scan);
    if (!update.pose_valid) continue;
    before += t <= kCovered ? 1 : 0;
    EXPECT_LT(poseError(pose(t), update.T_map_base).translation, 0.1) << "scan " << n;
  }
  EXPECT_GE(before, 10);
}

INSTANTIATE_TEST_SUITE_P(Times, SeesNothing,
                         ::testing::Combine(::testing::Values(0.3, 0.45, 0.6),
                                            ::testing::Values(0.0, 0.3, 0.8), ::testing::Bool()));

INSTANTIATE_TEST_SUITE_P(Speeds, SlowsDown, ::testing::Values(0.8, 1.3, 1.8));

INSTANTIATE_TEST_SUITE_P(Motions, HandheldMotion,
                         ::testing::Values(Motion{30.0, 0.5}, Motion{30.0, 1.0}, Motion{10.0, 0.5},
                                           Motion{10.0, 1.0}, Motion{5.0, 0.5}, Motion{30.0, 4.0},
                                           Motion{10.0, 2.0}, Motion{5.0, 2.0}, Motion{5.0, 5.0},
                                           Motion{2.0, 3.0}));

}  // namespace
}  // namespace ttsdf
