// The reported covariance against the spread of the estimates themselves.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "analytic_world.h"
#include "ttsdf_localization/registration/registration.h"

namespace ttsdf {
namespace {

using test::furnishedRoom;

struct Trial {
  Vector6d
      error;  // left perturbation about the sensor's position: [rotation; translation], estimate to truth
  Matrix6d covariance;
};

std::vector<Trial> trials(int count, double noise, const std::vector<Eigen::Vector3d>& rays,
                          const test::Sdf& map = furnishedRoom) {
  Registration registration(test::denseField(map, test::roomGeometry(0.05)));
  std::vector<Trial> result;
  for (int n = 0; n < count; ++n) {
    const auto seed = static_cast<unsigned>(n);
    const Eigen::Isometry3d truth = test::roomPose(seed % 10);
    const Eigen::Matrix3Xf points = test::castRays(furnishedRoom, truth, rays, noise, seed + 1000);
    const RegistrationResult r = registration.align(points, test::perturbed(truth, 0.05, 0.03, seed));
    EXPECT_TRUE(r.success);
    EXPECT_EQ(r.degenerate_directions, 0);
    Trial trial;
    trial.error << logSo3(truth.linear() * r.T_map_sensor.linear().transpose()),
        truth.translation() - r.T_map_sensor.translation();
    trial.covariance = r.covariance;
    result.push_back(trial);
  }
  return result;
}

/// Truths outside 3 sigma, over all coordinates.
int outsideThreeSigma(const std::vector<Trial>& all) {
  int outside = 0;
  for (const Trial& trial : all) {
    for (int d = 0; d < 6; ++d) {
      outside += std::abs(trial.error[d]) > 3.0 * std::sqrt(trial.covariance(d, d)) ? 1 : 0;
    }
  }
  return outside;
}

TEST(Covariance, IsSymmetricAndPositiveDefinite) {
  for (const Trial& trial : trials(5, 0.01, test::directions(1000))) {
    EXPECT_LT((trial.covariance - trial.covariance.transpose()).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_EQ(Eigen::LLT<Matrix6d>(trial.covariance).info(), Eigen::Success);
  }
}

TEST(Covariance, HoldsUpAgainstTheTruth) {
  const auto all = trials(200, 0.01, test::directions(1000));
  double squared = 0.0;
  for (const Trial& trial : all) squared += trial.error.dot(trial.covariance.ldlt().solve(trial.error));
  // Squared Mahalanobis distances have mean 6. Never narrow by more than a factor of two; it may be five
  // times too wide, because what neighbouring residuals have in common (here: edges in voxels of 5 cm) is
  // taken for surfaces that are off, which no residual shows.
  const double mean = squared / static_cast<double>(all.size());
  EXPECT_GT(mean, 6.0 / 25.0);
  EXPECT_LT(mean, 12.0);
  // Truth within 3 sigma of each coordinate in 99 % of the cases.
  EXPECT_LE(outsideThreeSigma(all), static_cast<int>(0.01 * 6.0 * static_cast<double>(all.size())));
}

TEST(Covariance, CoversErrorsThatWholeSurfacesOfTheMapShare) {
  // Surfaces are off by up to 1 cm, and by much the same within a metre.
  const auto map = [](const Eigen::Vector3d& p) {
    return furnishedRoom(p) + 0.005 * (std::sin(2.0 * p.x() + p.y()) + std::cos(2.0 * p.y() - p.z()));
  };
  const auto all = trials(100, 0.003, test::directions(1000), map);
  EXPECT_LE(outsideThreeSigma(all), static_cast<int>(0.01 * 6.0 * static_cast<double>(all.size())));
}

TEST(Covariance, GrowsWithTheNoise) {
  const auto spread = [](double noise) {
    double sum = 0.0;
    for (const Trial& trial : trials(10, noise, test::directions(1000))) {
      sum += std::sqrt(trial.covariance.bottomRightCorner<3, 3>().trace());
    }
    return sum;
  };
  const double ratio = spread(0.02) / spread(0.005);
  EXPECT_GT(ratio, 2.5);
  EXPECT_LT(ratio, 6.5);
}

TEST(Covariance, IsAboutTheSensorsPosition) {
  // A camera 2 m from what it sees: turning it about itself moves the points, so position and rotation are
  // correlated; about the scan's centroid they would not be.
  Registration registration(test::denseField(furnishedRoom, test::roomGeometry(0.05)));
  // The first view that fixes the pose from more than half a metre away.
  Eigen::Isometry3d truth;
  Eigen::Matrix3Xf points;
  RegistrationResult r;
  for (unsigned seed = 0; seed < 200 && !r.success; ++seed) {
    truth = test::roomPose(seed);
    points = test::castRays(furnishedRoom, truth, test::cameraDirections(60, 45), 0.01);
    if (points.cast<double>().rowwise().mean().norm() > 0.5) r = registration.align(points, truth);
  }
  ASSERT_TRUE(r.success);
  const Eigen::Vector3d lever = truth.linear() * points.cast<double>().rowwise().mean();
  ASSERT_GT(lever.norm(), 0.5);
  Matrix6d to_centroid = Matrix6d::Identity();  // translation of the centroid: v - lever x w
  to_centroid.bottomLeftCorner<3, 3>() = -hat(lever);
  const Matrix6d about_centroid = to_centroid * r.covariance * to_centroid.transpose();
  const double centroid_spread = about_centroid.diagonal().tail<3>().sum(),
               sensor_spread = r.covariance.diagonal().tail<3>().sum();
  EXPECT_LT(centroid_spread, sensor_spread);
}

}  // namespace
}  // namespace ttsdf
