// A camera in the hand, without odometry: a pose that is published is right, however it moves.

#include <gtest/gtest.h>

#include <cmath>

#include "../support/room.h"
#include "ttsdf_localization/localization/localizer.h"
#include "ttsdf_localization/localization/pose_covariance.h"

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
  GridGeometry geometry;
  DenseTensor tensor = test::sampleScene(test::Room(), 0.05, geometry);
  LocalizerOptions options;
  options.recovery.allow_global = false;
  Localizer localizer(options);
  localizer.setMap(std::make_shared<DenseDistanceField>(std::move(tensor), geometry));
  PoseGuess guess;
  guess.T_map_base = handPose(0.0);
  guess.covariance = isotropicCovariance(0.05, 0.1);
  localizer.setGuess(guess);
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
  const bool slow = GetParam().speed <= 1.0;  // at times it looks at one wall
  EXPECT_GE(published, slow ? 2 * scans / 3 : 0);
}

// A start pose before a bare wall, four scans a second: it is kept until the camera turns.
TEST(Handheld, AStartPoseBeforeAWallIsNotThrownAway) {
  GridGeometry geometry;
  DenseTensor tensor = test::sampleScene(test::Room(), 0.05, geometry);
  LocalizerOptions options;
  options.recovery.allow_global = false;
  Localizer localizer(options);
  localizer.setMap(std::make_shared<DenseDistanceField>(std::move(tensor), geometry));
  PoseGuess guess;
  guess.T_map_base = test::cameraPose({2.4, 0.7, 1.5}, -M_PI / 2.0);
  guess.covariance = isotropicCovariance(0.05, 0.1);
  localizer.setGuess(guess);
  for (int n = 0; n < 10; ++n) {
    LocalizerScan scan;
    scan.stamp = 100.0 + 0.25 * n;
    scan.points = test::renderScan(test::Room(), guess.T_map_base);
    EXPECT_GT(localizer.process(scan).registration.degenerate_directions, 0) << "scan " << n;
    EXPECT_NE(localizer.state(), LocalizerState::kLost) << "scan " << n;
  }
}

INSTANTIATE_TEST_SUITE_P(Motions, HandheldMotion,
                         ::testing::Values(Motion{30.0, 0.5}, Motion{30.0, 1.0}, Motion{10.0, 0.5},
                                           Motion{10.0, 1.0}, Motion{5.0, 0.5}, Motion{30.0, 4.0},
                                           Motion{10.0, 2.0}, Motion{5.0, 2.0}, Motion{5.0, 5.0},
                                           Motion{2.0, 3.0}));

}  // namespace
}  // namespace ttsdf
