// Frames with known errors of their poses against what the comparison finds.

#include "ttsdf_localization/agreement/frame_comparison.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "../support/rendered_scene.h"

namespace ttsdf {
namespace {

using testing::camera;
using testing::lookAt;
using testing::render;
using testing::Scene;

Scene room() {
  return Scene()
      .room({0, 0, 0}, {4, 3, 2.5})
      .box({1.2, 0.4, 0}, {2.0, 1.0, 0.8})
      .sphere({3.0, 2.2, 0.6}, 0.4)
      .box({0.3, 2.2, 0.0}, {0.8, 2.7, 1.6});
}

/// The camera turns round in the room and sways.
Eigen::Isometry3d view(int n) {
  const double angle = 0.35 * n;
  const Eigen::Vector3d eye(2.0 + 0.3 * std::sin(0.7 * n), 1.5 + 0.2 * std::cos(0.9 * n), 1.3);
  return lookAt(eye, eye + Eigen::Vector3d(std::cos(angle), std::sin(angle), -0.3));
}

/// Independent errors of the recorded poses: rms lengths.
std::vector<FrameDifference> compareWithErrors(double metres, double radians, int frames = 40) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0.0, 1.0 / std::sqrt(3.0));
  const auto vector = [&](double rms) -> Eigen::Vector3d {
    return rms * Eigen::Vector3d(normal(random), normal(random), normal(random));
  };
  FusionOptions fusion;
  FrameComparison comparison(fusion);
  const Scene scene = room();
  const CameraIntrinsics k = camera();
  for (int n = 0; n < frames; ++n) {
    Eigen::Isometry3d recorded = view(n);
    const DepthImage image = render(scene, k, recorded);
    recorded.linear() = expSo3(vector(radians)) * recorded.linear();
    recorded.translation() += vector(metres);
    comparison.add(image, k, recorded);
  }
  return comparison.compare();
}

TEST(FrameComparison, ExactPosesAgree) {
  const FrameAgreement agreement = summarize(compareWithErrors(0.0, 0.0), FusionOptions().voxel_size);
  EXPECT_GE(agreement.compared, 30);
  EXPECT_LT(agreement.position_median, 0.003);
  EXPECT_LT(agreement.rotation_median, 0.002);
  EXPECT_EQ(agreement.contradicting, 0);
}

TEST(FrameComparison, FindsHowFarPosesAreOff) {
  // A frame's own error and that of the others' mean, which is small in a room seen by many.
  for (const double metres : {0.01, 0.02}) {
    const FrameAgreement agreement =
        summarize(compareWithErrors(metres, 0.5 * metres), FusionOptions().voxel_size);
    EXPECT_GT(agreement.position_median, 0.7 * metres);
    EXPECT_LT(agreement.position_median, 1.6 * metres);
    EXPECT_GT(agreement.rotation_median, 0.5 * 0.5 * metres);
    EXPECT_LT(agreement.rotation_median, 2.0 * 0.5 * metres);
  }
}

TEST(FrameComparison, TheCovarianceOfTheSummaryHoldsForTheDifferences) {
  const auto differences = compareWithErrors(0.015, 0.008, 60);
  const FrameAgreement agreement = summarize(differences, FusionOptions().voxel_size);
  int below = 0, compared = 0;
  std::vector<double> squares;
  for (const FrameDifference& d : differences) {
    if (d.outcome != FrameDifference::Outcome::kCompared) continue;
    ++compared;
    const Matrix6d total = withMapErrors(agreement, d.covariance, d.covariance, d.centroid,
                                         varianceRatio(agreement, d.viewpoint));
    squares.push_back(d.step.dot(total.ldlt().solve(d.step)));
    below += squares.back() < 16.8 ? 1 : 0;
  }
  std::sort(squares.begin(), squares.end());
  EXPECT_GE(below, static_cast<int>(0.95 * compared));
  EXPECT_GT(squares[squares.size() / 2], 1.0);
  EXPECT_LT(squares[squares.size() / 2], 8.0);
}

/// Differences of frames on a way; those of its second half are three times as far off.
std::vector<FrameDifference> wayWithABadStretch(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<FrameDifference> differences;
  for (int n = 0; n < 120; ++n) {
    FrameDifference d;
    d.frame = static_cast<std::size_t>(n);
    d.outcome = FrameDifference::Outcome::kCompared;
    d.viewpoint = {{0.05 * n, 0.0, 1.0}, {0.0, 1.0, 0.0}};
    d.centroid = {0.0, 0.0, 2.0};
    d.covariance = 1e-8 * Matrix6d::Identity();
    for (int k = 0; k < 6; ++k) d.step[k] = (k < 3 ? 0.003 : 0.006) * (n < 60 ? 1.0 : 3.0) * normal(random);
    differences.push_back(d);
  }
  return differences;
}

TEST(FrameComparison, TheCovarianceIsWiderWhereFramesDisagree) {
  const FrameAgreement agreement = summarize(wayWithABadStretch(1), 0.02);
  EXPECT_GT(agreement.viewpoints.size(), 10U);
  EXPECT_LT(agreement.viewpoints.size(), 60U);
  // Frames of the same way that were not seen before: both halves have the right spread.
  for (const int half : {0, 1}) {
    std::vector<double> squares;
    for (const unsigned seed : {2U, 3U, 4U}) {
      const auto differences = wayWithABadStretch(seed);
      for (std::size_t n = 0; n < 55; ++n) {
        const FrameDifference& d = differences[n + (half ? 65 : 0)];
        const Matrix6d total = withMapErrors(agreement, d.covariance, d.covariance, d.centroid,
                                             varianceRatio(agreement, d.viewpoint));
        squares.push_back(d.step.dot(total.ldlt().solve(d.step)));
      }
    }
    std::sort(squares.begin(), squares.end());
    EXPECT_GT(squares[squares.size() / 2], 2.0) << "half " << half;
    EXPECT_LT(squares[squares.size() / 2], 8.0) << "half " << half;
    EXPECT_LT(squares[squares.size() * 95 / 100], 16.8) << "half " << half;
  }
}

TEST(FrameComparison, TwistsLeadFromTheRecordedPoseToWhereTheOthersSayItIs) {
  const Scene scene = room();
  const CameraIntrinsics k = camera();
  TsdfVolume others;
  for (int n = 0; n < 12; ++n) others.integrate(render(scene, k, view(n)), k, view(n));
  const Eigen::Isometry3d truth = lookAt({2.1, 1.4, 1.2}, {3.0, 2.2, 0.5});
  const DepthImage image = render(scene, k, truth);
  Vector6d error;  // of the recorded pose, in the sensor's axes
  error << 0.01, -0.008, 0.006, 0.015, -0.01, 0.02;
  Eigen::Isometry3d recorded = truth;
  recorded.linear() = truth.linear() * expSo3(error.head<3>());
  recorded.translation() += truth.linear() * error.tail<3>();
  const FrameDifference d = compareFrame(others, toPoints(image, k, 6, 0.2, 4.0), recorded);
  ASSERT_EQ(d.outcome, FrameDifference::Outcome::kCompared);
  EXPECT_LT((d.step.head<3>() + error.head<3>()).norm(), 0.002);
  EXPECT_LT((d.step.tail<3>() + error.tail<3>()).norm(), 0.004);
  EXPECT_GT(d.overlap, 0.5);
}

TEST(FrameComparison, SaysWhichFramesSawNothingInCommon) {
  // Two halves of one room that never meet: seen from the middle, one wall per frame.
  FrameComparison comparison({});
  const CameraIntrinsics k = camera(160, 120);
  const Scene scene = Scene()
                          .room({-10, -10, -10}, {10, 10, 10})
                          .box({1, -1, -1}, {1.5, 1, 1})
                          .box({-1.5, -1, -1}, {-1, 1, 1});
  for (const double side : {1.0, -1.0}) {
    const Eigen::Isometry3d pose = lookAt({0, 0, 0}, {side, 0.1, 0.1});
    comparison.add(render(scene, k, pose), k, pose);
  }
  const FrameAgreement agreement = summarize(comparison.compare(), FusionOptions().voxel_size);
  EXPECT_EQ(agreement.compared, 0);
  EXPECT_EQ(agreement.without_overlap, 2);
  EXPECT_FALSE(agreement.known());
}

TEST(FrameComparison, CloudsAreComparedAsImagesAre) {
  FrameComparison comparison({});
  const Scene scene = room();
  const CameraIntrinsics k = camera(160, 120);
  for (int n = 0; n < 10; ++n) {
    const Eigen::Isometry3d pose = view(n);
    comparison.add(toPoints(render(scene, k, pose), k, 1, 0.2, 4.0), pose);
  }
  const FrameAgreement agreement = summarize(comparison.compare(), FusionOptions().voxel_size);
  EXPECT_GE(agreement.compared, 8);
  EXPECT_LT(agreement.position_median, 0.01);
}

TEST(FrameComparison, OneFrameIsNotCompared) {
  FrameComparison comparison({});
  const CameraIntrinsics k = camera(160, 120);
  comparison.add(render(room(), k, view(0)), k, view(0));
  EXPECT_FALSE(summarize(comparison.compare(), FusionOptions().voxel_size).known());
}

}  // namespace
}  // namespace ttsdf
