#include "ttsdf_localization/evaluation/trajectory_error.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {
namespace {

namespace fs = std::filesystem;

std::string temporary(const std::string& name) {
  return (fs::temp_directory_path() / ("ttsdf_trajectory_" + std::to_string(::getpid()) + name)).string();
}

// A curve through space with turning heads.
PoseSequence curve(int count) {
  PoseSequence trajectory;
  for (int n = 0; n < count; ++n) {
    const double s = 0.1 * n;
    Vector6d twist;
    twist << 0.3 * std::sin(s), 0.2 * std::cos(2.0 * s), 0.1 * s, std::cos(s), s, std::sin(3.0 * s);
    trajectory.push_back({0.1 * n, expSe3(twist)});
  }
  return trajectory;
}

PoseSequence moved(PoseSequence trajectory, const Eigen::Isometry3d& T) {
  for (auto& pose : trajectory) pose.T_map_sensor = T * pose.T_map_sensor;
  return trajectory;
}

TEST(AbsoluteTrajectoryError, IsZeroForTheTruth) {
  const auto truth = curve(20);
  const auto error = absoluteTrajectoryError(truth, truth);
  EXPECT_EQ(error.pairs, 20u);
  EXPECT_NEAR(error.translation.max, 0.0, 1e-12);
  EXPECT_NEAR(error.rotation.max, 0.0, 1e-7);
}

TEST(AbsoluteTrajectoryError, KnownErrorsComeOut) {
  const auto truth = curve(4);
  PoseSequence estimate = truth;
  const double errors[] = {0.0, 0.3, 0.4, 0.5};
  for (int n = 0; n < 4; ++n) {
    estimate[n].T_map_sensor.translation().x() += errors[n];
    estimate[n].T_map_sensor.rotate(Eigen::AngleAxisd(0.1 * n, Eigen::Vector3d::UnitY()));
  }
  const auto error = absoluteTrajectoryError(estimate, truth);
  EXPECT_NEAR(error.translation.rmse, std::sqrt((0.09 + 0.16 + 0.25) / 4.0), 1e-12);
  EXPECT_NEAR(error.translation.mean, 0.3, 1e-12);
  EXPECT_NEAR(error.translation.median, 0.35, 1e-12);
  EXPECT_NEAR(error.translation.max, 0.5, 1e-12);
  EXPECT_NEAR(error.rotation.median, 0.15, 1e-9);
  EXPECT_NEAR(error.rotation.max, 0.3, 1e-9);
}

TEST(AbsoluteTrajectoryError, CountsAnOffsetUnlessAlignmentIsAsked) {
  const auto truth = curve(30);
  Vector6d twist;
  twist << 0.1, 0.2, 0.3, 1.0, -2.0, 0.5;
  const Eigen::Isometry3d T = expSe3(twist);
  const auto estimate = moved(truth, T);
  EXPECT_GT(absoluteTrajectoryError(estimate, truth).translation.rmse, 1.0);
  const auto aligned = absoluteTrajectoryError(estimate, truth, {0.02, true});
  EXPECT_NEAR(aligned.translation.max, 0.0, 1e-9);
  EXPECT_NEAR(aligned.rotation.max, 0.0, 1e-7);
  EXPECT_TRUE(aligned.T_truth_estimate.isApprox(T.inverse(), 1e-9));
}

TEST(RelativePoseError, IgnoresAnOffsetAndSeesDriftPerStep) {
  const auto truth = curve(11);
  PoseSequence estimate = moved(truth, expSe3((Vector6d() << 0.5, 0, 0, 1, 1, 1).finished()));
  EXPECT_NEAR(relativePoseError(estimate, truth, 1).translation.max, 0.0, 1e-9);
  for (int n = 0; n < 11; ++n) estimate[n].T_map_sensor = truth[n].T_map_sensor;
  for (int n = 5; n < 11; ++n) estimate[n].T_map_sensor.translation().z() += 0.2;  // one jump
  const auto error = relativePoseError(estimate, truth, 1);
  EXPECT_EQ(error.pairs, 10u);
  EXPECT_NEAR(error.translation.max, 0.2, 1e-9);
  EXPECT_NEAR(error.translation.mean, 0.02, 1e-9);
  EXPECT_NEAR(error.translation.rmse, std::sqrt(0.04 / 10.0), 1e-9);
}

TEST(RelativePoseError, LooksOverDeltaPairs) {
  const auto truth = curve(11);
  PoseSequence estimate = truth;
  for (int n = 5; n < 11; ++n) estimate[n].T_map_sensor.translation().z() += 0.2;
  const auto error = relativePoseError(estimate, truth, 3);
  EXPECT_EQ(error.pairs, 8u);
  EXPECT_NEAR(error.translation.mean, 3 * 0.2 / 8.0, 1e-9);  // three of the eight windows hold the jump
}

TEST(Associate, TakesTheNearestStampOnceWithinTheBound) {
  PoseSequence estimate(3), truth(3);
  estimate[0].stamp = 1.00;
  estimate[1].stamp = 1.01;
  estimate[2].stamp = 2.00;
  truth[0].stamp = 1.012;
  truth[1].stamp = 1.5;
  truth[2].stamp = 2.03;
  const auto pairs = associate(estimate, truth, 0.02);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0], std::make_pair(std::size_t{1}, std::size_t{0}));
  EXPECT_EQ(associate(estimate, truth, 0.05).size(), 2u);
}

TEST(TrajectoryErrors, NeedPairs) {
  auto truth = curve(5);
  auto late = truth;
  for (auto& pose : late) pose.stamp += 100.0;
  EXPECT_THROW(absoluteTrajectoryError(late, truth), std::invalid_argument);
  EXPECT_THROW(relativePoseError(truth, truth, 5), std::invalid_argument);
  EXPECT_THROW(relativePoseError(truth, truth, 0), std::invalid_argument);
  truth.resize(2);
  EXPECT_THROW(absoluteTrajectoryError(truth, truth, {0.02, true}), std::invalid_argument);
}

TEST(Trajectory, GoesThroughAFile) {
  const auto path = temporary("roundtrip.txt");
  const auto written = curve(7);
  writeTrajectory(path, written);
  const auto read = readTrajectory(path);
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t n = 0; n < read.size(); ++n) {
    EXPECT_NEAR(read[n].stamp, written[n].stamp, 1e-9);
    EXPECT_TRUE(read[n].T_map_sensor.isApprox(written[n].T_map_sensor, 1e-8));
  }
  fs::remove(path);
}

TEST(Trajectory, FileIsSortedAndChecked) {
  const auto path = temporary("bad.txt");
  std::ofstream(path) << "# comment\n2 0 0 0 0 0 0 1\r\n\n1 5 0 0 0 0 0 1\n";
  EXPECT_DOUBLE_EQ(readTrajectory(path).front().T_map_sensor.translation().x(), 5.0);
  for (const char* line : {"1 2 3\n", "1 0 0 0 0 0 0 0\n", "1 0 0 0 0 0 0 1 9\n", "a b c d e f g h\n",
                           "1 nan 0 0 0 0 nan 1\n"}) {
    std::ofstream(path) << line;
    EXPECT_THROW(readTrajectory(path), std::runtime_error) << line;
  }
  fs::remove(path);
  EXPECT_THROW(readTrajectory(path), std::runtime_error);
}

}  // namespace
}  // namespace ttsdf
