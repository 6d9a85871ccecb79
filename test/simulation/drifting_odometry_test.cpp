// Oracle: the mean square of an integrated Ornstein-Uhlenbeck process.
#include "ttsdf_localization/simulation/drifting_odometry.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ttsdf_localization/geometry/se3.h"
#include "ttsdf_localization/simulation/moving_clutter.h"
#include "ttsdf_localization/simulation/worlds.h"

namespace ttsdf {
namespace {

Eigen::Isometry3d at(double x) { return Eigen::Isometry3d(Eigen::Translation3d(x, 0.0, 0.0)); }

double expectedMeanSquare(double drift, double length, double s) {
  return 2.0 * drift * drift * length * length * (s / length - 1.0 + std::exp(-s / length));
}

/// Mean square of the error after a straight run of `distance`, over many seeds.
struct Spread {
  double translation = 0.0, rotation = 0.0;
};
Spread spread(OdometryOptions options, double distance, int runs) {
  Spread sum;
  for (int seed = 0; seed < runs; ++seed) {
    options.odometry_seed = seed;
    DriftingOdometry odometry(options);
    Eigen::Isometry3d estimate = odometry.update(at(0.0));
    const int steps = static_cast<int>(distance / 0.02);
    for (int i = 1; i <= steps; ++i) estimate = odometry.update(at(distance * i / steps));
    const PoseError error = poseError(at(distance), estimate);
    sum.translation += error.translation * error.translation / runs;
    sum.rotation += error.rotation * error.rotation / runs;
  }
  return sum;
}

TEST(DriftingOdometry, TranslationErrorGrowsAsStated) {
  OdometryOptions options;
  options.rotation_drift = 0.0;
  constexpr int kRuns = 2000;
  for (const double s : {0.5, 1.0, 20.0}) {
    const double expected = expectedMeanSquare(options.translation_drift, options.correlation_length, s);
    // A mean square of 3 Gaussian components over n runs has the relative deviation sqrt(2 / 3n) = 1.8 %.
    EXPECT_NEAR(spread(options, s, kRuns).translation / expected, 1.0, 5.0 * std::sqrt(2.0 / (3.0 * kRuns)))
        << s;
  }
}

TEST(DriftingOdometry, RotationErrorGrowsAsStated) {
  OdometryOptions options;
  options.translation_drift = 0.0;
  constexpr int kRuns = 2000;
  const double expected = expectedMeanSquare(options.rotation_drift, options.correlation_length, 1.0);
  EXPECT_NEAR(spread(options, 1.0, kRuns).rotation / expected, 1.0, 5.0 * std::sqrt(2.0 / (3.0 * kRuns)));
}

TEST(DriftingOdometry, DefaultIsFivePercentAndFiftyMilliradiansInAMetre) {
  const Spread metre = spread({}, 1.0, 1000);
  EXPECT_NEAR(std::sqrt(metre.rotation), 0.05, 0.005);
  EXPECT_NEAR(std::sqrt(metre.translation), 0.05, 0.01);  // a little more: the turning bends the path
}

TEST(DriftingOdometry, IsExactWithoutDrift) {
  OdometryOptions options;
  options.translation_drift = options.rotation_drift = 0.0;
  DriftingOdometry odometry(options);
  const World world = makeWorld("apartment");
  const Trajectory trajectory(world.tour, true);
  const Eigen::Isometry3d start = trajectory.pose(0.0);
  for (double t = 0.0; t < trajectory.duration(); t += 0.05) {
    const Eigen::Isometry3d T = odometry.update(trajectory.pose(t));
    EXPECT_TRUE((start * T).isApprox(trajectory.pose(t), 1e-9));
  }
}

TEST(DriftingOdometry, StandingStillDoesNotDrift) {
  DriftingOdometry odometry;
  odometry.update(at(0.0));
  const Eigen::Isometry3d before = odometry.update(at(1.0));
  for (int i = 0; i < 1000; ++i) odometry.update(at(1.0));
  EXPECT_TRUE(odometry.pose().isApprox(before, 1e-12));
}

TEST(DriftingOdometry, AJumpIsNotMeasuredWhenSkipped) {
  DriftingOdometry odometry;
  odometry.update(at(0.0));
  const Eigen::Isometry3d before = odometry.update(at(1.0));
  odometry.skip();
  EXPECT_TRUE(odometry.update(at(6.0)).isApprox(before));
  const Eigen::Isometry3d after = odometry.update(at(6.5));
  EXPECT_NEAR((before.inverse() * after).translation().norm(), 0.5, 0.15);
}

TEST(DriftingOdometry, SameSeedSameDrift) {
  OdometryOptions options;
  DriftingOdometry a(options), b(options);
  options.odometry_seed = 2;
  DriftingOdometry c(options);
  for (double x = 0.0; x < 3.0; x += 0.1) {
    a.update(at(x));
    b.update(at(x));
    c.update(at(x));
  }
  EXPECT_EQ(a.pose().matrix(), b.pose().matrix());
  EXPECT_FALSE(a.pose().isApprox(c.pose(), 1e-6));
}

TEST(DriftingOdometry, RotationStaysARotation) {
  DriftingOdometry odometry;
  const World world = makeWorld("room");
  const Trajectory trajectory(world.tour, true);
  for (int i = 0; i < 20000; ++i) odometry.update(trajectory.pose(0.03 * i));
  const Eigen::Matrix3d R = odometry.pose().linear();
  EXPECT_TRUE((R * R.transpose()).isIdentity(1e-12));
}

TEST(MovingClutter, PeopleStandOnTheFloorInFrontOfTheCamera) {
  ClutterOptions options;
  options.people = 4;
  const MovingClutter clutter(options);
  Eigen::Isometry3d T = at(3.0);
  T.linear() = Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.translation().z() = 1.4;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  double moved = 0.0;
  for (double t = 0.0; t < 20.0; t += 0.1) {
    const auto people = clutter.at(t, T, 0.5);
    ASSERT_EQ(people.size(), 4u);
    for (const Solid& person : people) {
      EXPECT_NEAR(person.boundingBox().min().z(), 0.5, 1e-12);
      const Eigen::Vector3d in_base = T.inverse() * person.center();
      EXPECT_GT(in_base.x(), 0.5);
      EXPECT_LT(in_base.head<2>().norm(), options.far + 1e-9);
    }
    if (t > 0.0) {
      const double step = (people[0].center() - before).norm();
      EXPECT_LT(step,
                0.1 * options.walking_speed * 1.6);  // a sine is fastest in the middle: pi / 2 of its mean
      moved += step;
    }
    before = people[0].center();
  }
  EXPECT_NEAR(moved / 20.0, options.walking_speed, 0.25 * options.walking_speed);
  EXPECT_TRUE(MovingClutter().at(1.0, T).empty());
  options.far = 0.6;
  EXPECT_THROW(MovingClutter{options}, std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
