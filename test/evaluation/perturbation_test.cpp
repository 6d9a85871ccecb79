#include "ttsdf_localization/evaluation/perturbation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {
namespace {

Eigen::Isometry3d somePose() {
  Vector6d twist;
  twist << 0.4, -1.1, 0.7, 2.0, -3.0, 1.5;
  return expSe3(twist);
}

TEST(Perturbations, AreThePapersSweepByDefault) {
  const auto all = perturbations(SweepPlan{}, 0);
  ASSERT_EQ(all.size(), 50u);
  for (int n = 0; n < 25; ++n) EXPECT_EQ(all[n].kind, PerturbationKind::kTranslation);
  for (int n = 25; n < 50; ++n) EXPECT_EQ(all[n].kind, PerturbationKind::kRotation);
  EXPECT_DOUBLE_EQ(all[24].magnitude, 1.0);
  EXPECT_DOUBLE_EQ(all[49].magnitude, 0.25);
  EXPECT_EQ(all[7].direction, 2);
}

TEST(Perturbations, MovePurelyOrTurnPurelyByTheirMagnitude) {
  const Eigen::Isometry3d T_map_sensor = somePose();
  for (const auto& p : perturbations(SweepPlan{}, 17)) {
    const PoseError error = poseError(T_map_sensor, p.apply(T_map_sensor));
    const bool moves = p.kind == PerturbationKind::kTranslation;
    EXPECT_NEAR(error.translation, moves ? p.magnitude : 0.0, 1e-12);
    EXPECT_NEAR(error.rotation, moves ? 0.0 : p.magnitude, 1e-9);
  }
}

TEST(Perturbations, RotationKeepsTheSensorWhereItIs) {
  const Eigen::Isometry3d T_map_sensor = somePose();
  for (const auto& p : perturbations({{}, {0.25}, 5, 1}, 3)) {
    EXPECT_NEAR((p.apply(T_map_sensor).translation() - T_map_sensor.translation()).norm(), 0.0, 1e-12);
  }
}

TEST(Perturbations, DoNotDependOnOtherMagnitudesOrOnTheOrder) {
  const auto all = perturbations(SweepPlan{}, 5);
  const auto some = perturbations({{0.2}, {0.1}, 2, 1}, 5);
  ASSERT_EQ(some.size(), 4u);
  EXPECT_TRUE(some[1].T_sensor_prior.isApprox(all[11].T_sensor_prior, 0.0));
  EXPECT_TRUE(some[2].T_sensor_prior.isApprox(all[40].T_sensor_prior, 0.0));
}

TEST(Perturbations, DifferByScanAndSeedAndRepeatExactly) {
  const SweepPlan plan{{0.2}, {}, 1, 1};
  SweepPlan other_seed = plan;
  other_seed.seed = 2;
  const auto first = perturbations(plan, 5)[0].T_sensor_prior;
  EXPECT_TRUE(first.isApprox(perturbations(plan, 5)[0].T_sensor_prior, 0.0));
  EXPECT_FALSE(first.isApprox(perturbations(plan, 6)[0].T_sensor_prior, 1e-6));
  EXPECT_FALSE(first.isApprox(perturbations(other_seed, 5)[0].T_sensor_prior, 1e-6));
}

// For directions uniform on the sphere, mean = 0 and covariance = I / 3; with n samples the mean of a
// coordinate has a standard deviation of sqrt(1 / 3n), and that of its square sqrt(4 / 45n).
TEST(Perturbations, DirectionsAreUniformOnTheSphere) {
  const int n = 20000;
  const SweepPlan plan{{1.0}, {}, n, 7};
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), squares = Eigen::Vector3d::Zero();
  for (const auto& p : perturbations(plan, 0)) {
    mean += p.T_sensor_prior.translation() / n;
    squares += p.T_sensor_prior.translation().cwiseAbs2() / n;
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(mean[axis], 0.0, 4.0 * std::sqrt(1.0 / (3.0 * n)));
    EXPECT_NEAR(squares[axis], 1.0 / 3.0, 4.0 * std::sqrt(4.0 / (45.0 * n)));
  }
}

TEST(Perturbations, RefuseNonsense) {
  EXPECT_THROW(perturbations({{-0.1}, {}, 1, 1}, 0), std::invalid_argument);
  EXPECT_THROW(perturbations({{std::nan("")}, {}, 1, 1}, 0), std::invalid_argument);
  EXPECT_THROW(perturbations({{0.1}, {}, -1, 1}, 0), std::invalid_argument);
}

TEST(PerturbationKind, NamesGoBothWays) {
  EXPECT_EQ(perturbationKindFromName(name(PerturbationKind::kTranslation)), PerturbationKind::kTranslation);
  EXPECT_EQ(perturbationKindFromName(name(PerturbationKind::kRotation)), PerturbationKind::kRotation);
  EXPECT_THROW(perturbationKindFromName("shear"), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
