#include "ttsdf_localization/simulation/trajectory.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ttsdf_localization/simulation/worlds.h"

namespace ttsdf {
namespace {

std::vector<Waypoint> square() {
  return {{{0.0, 0.0, 1.0}, {1.0, 0.0, 1.0}},
          {{2.0, 0.0, 1.2}, {2.0, 1.0, 1.0}},
          {{2.0, 2.0, 1.0}, {0.0, 2.0, 0.5}},
          {{0.0, 2.0, 1.1}, {0.0, 0.0, 1.0}}};
}

TEST(Trajectory, PassesThroughItsWaypointsFacingTheirTargets) {
  TrajectoryOptions still;
  still.sway_position = 0.0;
  still.sway_angle = 0.0;
  for (const bool closed : {false, true}) {
    const Trajectory trajectory(square(), closed, still);
    const auto poses = trajectory.sample(500.0);
    for (const Waypoint& w : square()) {
      double nearest = 1e9;
      Eigen::Vector3d forward = Eigen::Vector3d::Zero();
      for (const auto& stamped : poses) {
        const double d = (stamped.T_map_base.translation() - w.position).norm();
        if (d < nearest) {
          nearest = d;
          forward = stamped.T_map_base.linear().col(0);
        }
      }
      EXPECT_LT(nearest, 0.002);
      EXPECT_GT(forward.dot((w.look_at - w.position).normalized()), std::cos(0.01));
    }
  }
}

TEST(Trajectory, KeepsBothSpeedLimits) {
  const World world = makeWorld("apartment");
  TrajectoryOptions options;
  options.speed = 0.6;
  options.turn_rate = 0.8;
  options.sway_position = 0.05;
  options.sway_angle = 0.05;
  const Trajectory trajectory(world.tour, world.closed, options);
  constexpr double kStep = 0.002;
  double fastest = 0.0, fastest_turn = 0.0;
  for (double t = 0.0; t < 2.0 * trajectory.duration(); t += kStep) {
    const Eigen::Isometry3d motion = trajectory.pose(t).inverse() * trajectory.pose(t + kStep);
    fastest = std::max(fastest, motion.translation().norm() / kStep);
    fastest_turn = std::max(fastest_turn, Eigen::AngleAxisd(motion.linear()).angle() / kStep);
  }
  EXPECT_LE(fastest, options.speed);
  EXPECT_LE(fastest_turn, options.turn_rate);
  EXPECT_GT(fastest, 0.75 * options.speed);  // and makes use of them
  EXPECT_GT(fastest_turn, 0.75 * options.turn_rate);
}

TEST(Trajectory, MovesSmoothly) {
  // The acceleration stays far below what a jump in speed would give (speed / step).
  const World world = makeWorld("apartment");
  const Trajectory trajectory(world.tour, world.closed);
  constexpr double kStep = 0.01;
  double largest = 0.0;
  for (double t = kStep; t < 2.0 * trajectory.duration(); t += kStep) {
    const Eigen::Vector3d a = trajectory.pose(t - kStep).translation(), b = trajectory.pose(t).translation(),
                          c = trajectory.pose(t + kStep).translation();
    largest = std::max(largest, (a - 2.0 * b + c).norm() / (kStep * kStep));
  }
  EXPECT_LT(largest, 4.0);
}

TEST(Trajectory, ClosedPathReturnsToItsStartAndGoesOn) {
  TrajectoryOptions still;
  still.sway_position = 0.0;
  still.sway_angle = 0.0;
  const Trajectory trajectory(square(), true, still);
  const double lap = trajectory.duration();
  EXPECT_TRUE(trajectory.pose(0.0).isApprox(trajectory.pose(lap), 1e-9));
  EXPECT_TRUE(trajectory.pose(0.3).isApprox(trajectory.pose(3.0 * lap + 0.3), 1e-9));
  const Trajectory open(square(), false, still);
  EXPECT_TRUE(open.pose(0.3).isApprox(open.pose(2.0 * open.duration() - 0.3), 1e-9));
}

TEST(Trajectory, NeverRollsBeyondItsSway) {
  TrajectoryOptions options;
  options.sway_angle = 0.0;
  const World world = makeWorld("apartment");
  for (const auto& stamped : Trajectory(world.tour, true, options).sample(10.0)) {
    EXPECT_NEAR(stamped.T_map_base.linear()(2, 1), 0.0, 1e-12);  // the y axis stays level
    EXPECT_GT(stamped.T_map_base.linear()(2, 2), 0.5);           // and z up
  }
}

TEST(Trajectory, SamplesAtAConstantRate) {
  const Trajectory trajectory(square(), true);
  const auto poses = trajectory.sample(30.0);
  ASSERT_GT(poses.size(), 100u);
  for (std::size_t i = 0; i < poses.size(); ++i)
    EXPECT_NEAR(poses[i].time, static_cast<double>(i) / 30.0, 1e-12);
  EXPECT_LE(poses.back().time, trajectory.duration());
  EXPECT_GT(poses.back().time, trajectory.duration() - 1.0 / 30.0);
}

TEST(Trajectory, RefusesPathsThatAreNone) {
  EXPECT_THROW(Trajectory({square()[0]}, false), std::invalid_argument);
  EXPECT_THROW(Trajectory({square()[0], square()[1]}, true), std::invalid_argument);
  EXPECT_THROW(Trajectory({square()[0], square()[0]}, false), std::invalid_argument);
  EXPECT_THROW(Trajectory({square()[0], {{1.0, 1.0, 1.0}, {1.0, 1.0, 1.0}}}, false), std::invalid_argument);
  TrajectoryOptions options;
  options.speed = 0.0;
  EXPECT_THROW(Trajectory(square(), true, options), std::invalid_argument);
  EXPECT_THROW(Trajectory(square(), true).sample(0.0), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
