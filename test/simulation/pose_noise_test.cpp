#include "ttsdf_localization/simulation/pose_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace ttsdf {
namespace {

std::vector<Vector6d> errors(const PoseNoiseOptions& options, int count) {
  PoseNoise noise(options);
  Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
  truth.linear() = expSo3({0.3, -0.2, 1.0});
  truth.translation() << 1.0, 2.0, 3.0;
  std::vector<Vector6d> result;
  for (int n = 0; n < count; ++n) {
    const Eigen::Isometry3d recorded = noise.perturb(truth);
    Vector6d error;
    error << logSo3(truth.linear().transpose() * recorded.linear()),
        recorded.translation() - truth.translation();
    result.push_back(error);
  }
  return result;
}

TEST(PoseNoise, HasTheSizeAskedFor) {
  PoseNoiseOptions options;
  options.pose_noise = 0.02, options.pose_angle_noise = 0.01;
  double turned = 0.0, moved = 0.0;
  const auto all = errors(options, 5000);
  for (const Vector6d& e : all) turned += e.head<3>().squaredNorm(), moved += e.tail<3>().squaredNorm();
  EXPECT_NEAR(std::sqrt(moved / 5000.0), 0.02, 0.0005);
  EXPECT_NEAR(std::sqrt(turned / 5000.0), 0.01, 0.00025);
}

TEST(PoseNoise, IsAlikeInNeighbouringFrames) {
  PoseNoiseOptions options;
  options.pose_noise = 0.02;
  options.pose_noise_correlation = 5.0;
  const auto all = errors(options, 20000);
  const auto correlation = [&all](std::size_t lag) {
    double product = 0.0, square = 0.0;
    for (std::size_t n = 0; n + lag < all.size(); ++n) {
      product += all[n].tail<3>().dot(all[n + lag].tail<3>()), square += all[n].tail<3>().squaredNorm();
    }
    return product / square;
  };
  EXPECT_NEAR(correlation(1), std::exp(-0.2), 0.03);
  EXPECT_NEAR(correlation(5), std::exp(-1.0), 0.06);
  EXPECT_NEAR(correlation(50), 0.0, 0.06);
}

TEST(PoseNoise, WithoutSizeLeavesPosesAsTheyAre) {
  for (const Vector6d& e : errors({}, 3)) EXPECT_EQ(e.norm(), 0.0);
  EXPECT_TRUE(PoseNoiseOptions{}.none());
}

TEST(PoseNoise, RefusesASizeBelowZero) {
  PoseNoiseOptions options;
  options.pose_noise = -0.1;
  EXPECT_THROW(PoseNoise{options}, std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
