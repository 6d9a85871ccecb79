// Scans that do not fix every direction: the prior stays where they say nothing.

#include <gtest/gtest.h>

#include "analytic_world.h"
#include "ttsdf_localization/registration/registration.h"

namespace ttsdf {
namespace {

using test::castRays;
using test::denseField;
using test::furnishedRoom;
using test::perturbed;
using test::roomGeometry;
using test::roomPose;

constexpr double kVoxel = 0.05;

/// The points with |x| below `limit` [m].
Eigen::Matrix3Xf withinAlongX(const Eigen::Matrix3Xf& points, float limit) {
  Eigen::Matrix3Xf kept(3, points.cols());
  Eigen::Index count = 0;
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    if (std::abs(points(0, n)) < limit) kept.col(count++) = points.col(n);
  }
  return kept.leftCols(count);
}

Matrix6d isotropic(double rotation_sigma, double translation_sigma) {
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(rotation_sigma * rotation_sigma),
      Eigen::Vector3d::Constant(translation_sigma * translation_sigma);
  return variances.asDiagonal();
}

TEST(Registration, FindsTheCentreOfASphereAndKeepsTheRotation) {
  const auto sphere = [](const Eigen::Vector3d& p) {
    return 1.0 - (p - Eigen::Vector3d(1.5, 1.5, 1.2)).norm();
  };
  Registration registration(denseField(sphere, roomGeometry(kVoxel)));
  const Eigen::Isometry3d truth(Eigen::Translation3d(1.5, 1.5, 1.2));
  const Eigen::Matrix3Xf points = castRays(sphere, truth, test::directions(2000));
  const Eigen::Isometry3d prior = perturbed(truth, 0.1, 0.2, 3);
  const RegistrationResult result = registration.align(points, prior);
  EXPECT_FALSE(result.success) << "0.25 rad of the prior are not good enough";
  EXPECT_EQ(result.reason, TerminationReason::kDegenerate);
  EXPECT_EQ(result.degenerate_directions, 3);
  EXPECT_TRUE(registration.align(points, prior, isotropic(0.01, 0.01)).success) << "a prior that is";
  EXPECT_LT((result.T_map_sensor.translation() - truth.translation()).norm(), 0.05 * kVoxel);
  EXPECT_LT(
      poseError(Eigen::Isometry3d(result.T_map_sensor.linear()), Eigen::Isometry3d(prior.linear())).rotation,
      0.02)
      << "nothing tells how the sphere is turned: the prior stays, within a tenth of its 0.2 rad";
}

TEST(Registration, ASingleWallKeepsThePriorInThreeDirections) {
  const auto wall = [](const Eigen::Vector3d& p) { return p.z() - 0.5; };
  Registration registration(denseField(wall, roomGeometry(kVoxel)));
  Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
  truth.translation() = Eigen::Vector3d(2.0, 1.5, 1.9);
  truth.linear() = expSo3(Eigen::Vector3d(M_PI, 0.0, 0.0));  // looks down
  const Eigen::Matrix3Xf points = castRays(wall, truth, test::cameraDirections(40, 30));
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Eigen::Isometry3d prior = perturbed(truth, 0.1, 0.05, seed);
    const RegistrationResult result = registration.align(points, prior);
    EXPECT_FALSE(result.success);
    EXPECT_EQ(result.reason, TerminationReason::kDegenerate);
    EXPECT_EQ(result.degenerate_directions, 3);
    EXPECT_TRUE(registration.align(points, prior, isotropic(0.01, 0.01)).success);
    // Found: the distance and both tilts.
    const Eigen::Vector3d centroid = points.cast<double>().rowwise().mean();
    const Eigen::Vector3d moved = result.T_map_sensor * centroid;
    EXPECT_NEAR(moved.z(), 0.5, 0.05 * kVoxel);
    EXPECT_NEAR((result.T_map_sensor.linear() * Eigen::Vector3d::UnitZ()).dot(Eigen::Vector3d::UnitZ()), -1.0,
                1e-5);
    // Kept: where along the wall the sensor is and the turn about its normal, to a tenth of the perturbation.
    EXPECT_LT((result.T_map_sensor.translation() - prior.translation()).head<2>().norm(), 0.01) << seed;
    const Eigen::Vector3d turn = logSo3(result.T_map_sensor.linear() * prior.linear().transpose());
    EXPECT_LT(std::abs(turn.z()), 0.005) << seed;
    // And said so: the degenerate directions have the variance of the prior, half the scan's radius.
    EXPECT_GT(result.covariance(3, 3), 0.1 * 0.1);
    EXPECT_GT(result.covariance(4, 4), 0.1 * 0.1);
    EXPECT_LT(result.hessian_eigenvalues[2], 0.01);
    EXPECT_GT(result.hessian_eigenvalues[3], 0.05);
  }
}

TEST(Registration, ACorridorKeepsThePriorAlongIt) {
  const auto corridor = [](const Eigen::Vector3d& p) {
    return std::min({p.y() - 0.5, 2.3 - p.y(), p.z(), 2.2 - p.z()});
  };
  Registration registration(denseField(corridor, roomGeometry(kVoxel)));
  Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
  truth.translation() = Eigen::Vector3d(1.8, 1.4, 1.1);
  Eigen::Matrix3Xf points = castRays(corridor, truth, test::directions(2500));
  // Up to 1.5 m along: what is seen must be inside the map.
  points = withinAlongX(points, 1.5f);
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Eigen::Isometry3d prior = perturbed(truth, 0.1, 0.05, seed);
    const RegistrationResult result = registration.align(points, prior);
    EXPECT_EQ(result.reason, TerminationReason::kDegenerate);
    EXPECT_EQ(result.degenerate_directions, 1);
    EXPECT_LT(std::abs(result.T_map_sensor.translation().x() - prior.translation().x()), 0.01) << seed;
    EXPECT_LT((result.T_map_sensor.translation() - truth.translation()).tail<2>().norm(), 0.05 * kVoxel)
        << seed;
    EXPECT_LT(poseError(truth, result.T_map_sensor).rotation, 0.05 * kVoxel) << seed;
    EXPECT_GT(result.covariance(3, 3), 0.2 * 0.2) << "along the corridor";
    EXPECT_LT(result.covariance(4, 4), 1e-4);
    const Vector6d open = result.hessian_eigenvectors.col(0);
    EXPECT_GT(std::abs(open[3]), 0.99) << "the degenerate direction is the translation along x";
  }
}

// The far field and further starts find the way out of half a metre across the corridor. Along it they may go
// where they like: the answer is the prior, in the measure that it is trusted.
TEST(Registration, TheAnswerIsThePriorAlongACorridorWhateverFoundTheRest) {
  const auto corridor = [](const Eigen::Vector3d& p) {
    return std::min({p.y() - 0.3, 2.7 - p.y(), p.z(), 2.2 - p.z()});
  };
  Registration registration(denseField(corridor, roomGeometry(kVoxel)));
  Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
  truth.translation() = Eigen::Vector3d(1.8, 1.4, 1.1);
  Eigen::Matrix3Xf points = castRays(corridor, truth, test::directions(2500));
  points = withinAlongX(points, 1.5f);
  for (unsigned seed = 0; seed < 5; ++seed) {
    Eigen::Isometry3d prior = perturbed(truth, 0.0, 0.05, seed);
    prior.translation() += Eigen::Vector3d(0.2, seed % 2 ? 0.5 : -0.5, 0.3);
    for (const double sigma : {0.3, 1.0}) {
      const RegistrationResult result = registration.align(points, prior, isotropic(0.2, sigma));
      EXPECT_LT(std::abs(result.T_map_sensor.translation().x() - prior.translation().x()), 0.02) << seed;
      EXPECT_LT((result.T_map_sensor.translation() - truth.translation()).tail<2>().norm(), 0.01) << seed;
      EXPECT_NEAR(std::sqrt(result.covariance(3, 3)), sigma, 0.05 * sigma) << seed;
    }
  }
}

// A map's ripples pull a little along bare walls. A sure prior then holds the pose, and that is success; but
// the scan has measured nothing there, and a localizer that took it for a measurement would follow its own
// guesses.
TEST(Registration, ASurePriorDoesNotMakeASlidingScanAMeasurement) {
  const auto corridor = [](const Eigen::Vector3d& p) {
    return std::min({p.y() - 0.5, 2.3 - p.y(), p.z(), 2.2 - p.z()});
  };
  const auto rippled = [&corridor](const Eigen::Vector3d& p) {
    return corridor(p) + 0.004 * std::sin(15.0 * p.x() + 3.0 * p.y() - 4.0 * p.z());
  };
  Registration registration(denseField(rippled, roomGeometry(kVoxel)));
  Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
  truth.translation() = Eigen::Vector3d(1.8, 1.4, 1.1);
  const Eigen::Matrix3Xf points = withinAlongX(castRays(corridor, truth, test::directions(2500)), 1.5f);
  for (const double sigma : {0.005, 0.02, 0.5}) {
    Eigen::Isometry3d prior = truth;
    prior.translation().x() += 0.02;
    const RegistrationResult result = registration.align(points, prior, isotropic(0.01, sigma));
    EXPECT_EQ(result.degenerate_directions, 1) << sigma;
    EXPECT_EQ(result.success, sigma < 0.1) << sigma;
    EXPECT_LT(std::abs(result.T_map_sensor.translation().x() - prior.translation().x()), 0.01) << sigma;
  }
}

// A scan of one point, repeated, lies on every surface at once.
TEST(Registration, APointRepeatedOrATinyPatchFixesNoPose) {
  Registration registration(denseField(furnishedRoom, roomGeometry(kVoxel)));
  const Eigen::Isometry3d truth = roomPose(1);
  const Eigen::Matrix3Xf points = castRays(furnishedRoom, truth, test::directions(1000));
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Eigen::Matrix3Xf repeated = points.col(7 + seed).replicate(1, 2000);
    const RegistrationResult result = registration.align(repeated, perturbed(truth, 0.05, 0.02, seed));
    EXPECT_FALSE(result.success);
    EXPECT_EQ(result.reason, TerminationReason::kDegenerate);
    EXPECT_GE(result.degenerate_directions, 5);
  }
  std::vector<Eigen::Vector3d> narrow;
  for (const auto& ray : test::cameraDirections(40, 30)) {
    narrow.push_back(Eigen::Vector3d(0.05 * ray.x(), 0.05 * ray.y(), ray.z()).normalized());
  }
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Eigen::Matrix3Xf patch = castRays(furnishedRoom, roomPose(seed), narrow, 0.002);
    const RegistrationResult result = registration.align(patch, perturbed(roomPose(seed), 0.05, 0.02, seed));
    EXPECT_FALSE(result.success) << seed;
    EXPECT_GE(result.degenerate_directions, 3) << seed;
  }
}

}  // namespace
}  // namespace ttsdf
