#include "../../src/registration/multi_start/start_poses.h"

#include <gtest/gtest.h>

#include "analytic_world.h"

namespace ttsdf {
namespace {

const Eigen::Isometry3d kPrior = expSe3((Vector6d() << 0.3, -0.5, 0.8, 2.0, 1.4, 1.1).finished());

Matrix6d correlatedCovariance() {
  Matrix6d root = Matrix6d::Zero();
  root.diagonal() << 0.05, 0.02, 0.1, 0.5, 0.1, 0.2;
  root(3, 2) = 0.3;  // turning goes with moving along x
  return root * root.transpose();
}

Vector6d difference(const Eigen::Isometry3d& T, const Eigen::Isometry3d& T_prior) {
  Vector6d xi;
  xi << logSo3(T.linear() * T_prior.linear().transpose()), T.translation() - T_prior.translation();
  return xi;
}

TEST(StartsAround, BeginWithThePrior) {
  const auto starts = startsAround(kPrior, correlatedCovariance(), 10, 1);
  ASSERT_EQ(starts.size(), 10u);
  EXPECT_EQ(starts.front().matrix(), kPrior.matrix());
  EXPECT_EQ(startsAround(kPrior, correlatedCovariance(), 1, 1).size(), 1u);
}

TEST(StartsAround, HaveTheCovarianceTheyAreAskedFor) {
  const Matrix6d wanted = correlatedCovariance();
  const auto starts = startsAround(kPrior, wanted, 4001, 1);
  Vector6d mean = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();
  for (std::size_t n = 1; n < starts.size(); ++n) {
    const Vector6d xi = difference(starts[n], kPrior);
    mean += xi / 4000.0;
    covariance += xi * xi.transpose() / 4000.0;
  }
  const Vector6d sigma = wanted.diagonal().cwiseSqrt();
  for (int a = 0; a < 6; ++a) {
    EXPECT_NEAR(mean[a], 0.0, 0.05 * sigma[a]);
    for (int b = 0; b < 6; ++b)
      EXPECT_NEAR(covariance(a, b), wanted(a, b), 0.05 * sigma[a] * sigma[b]) << a << b;
  }
}

TEST(StartsAround, RepeatWithTheSeed) {
  const Matrix6d covariance = correlatedCovariance();
  const auto a = startsAround(kPrior, covariance, 20, 1), b = startsAround(kPrior, covariance, 20, 1),
             c = startsAround(kPrior, covariance, 20, 2);
  for (std::size_t n = 0; n < a.size(); ++n) EXPECT_EQ(a[n].matrix(), b[n].matrix());
  EXPECT_NE(a[5].matrix(), c[5].matrix());
}

TEST(StartsAround, StayWhereTheCovarianceIsZero) {
  for (const auto& T : startsAround(kPrior, Matrix6d::Zero(), 10, 1)) {
    EXPECT_LT((T.matrix() - kPrior.matrix()).cwiseAbs().maxCoeff(), 1e-12);
  }
}

class StartsOverMapTest : public testing::Test {
 protected:
  const std::shared_ptr<const DistanceField> field_ =
      test::denseField(test::furnishedRoom, test::roomGeometry());
};

TEST_F(StartsOverMapTest, FillTheFreeSpaceEvenly) {
  const auto starts = startsOverMap(*field_, *field_, std::nullopt, 0.1, 4000, 1);
  ASSERT_EQ(starts.size(), 4000u);
  std::vector<int> eighths(8, 0);
  for (const auto& T : starts) {
    EXPECT_GT(test::furnishedRoom(T.translation()), 0.1 - 0.03) << "clearance up to interpolation at edges";
    const Eigen::Vector3d p = T.translation();
    ++eighths[static_cast<std::size_t>((p.x() > 2.0 ? 1 : 0) + (p.y() > 1.5 ? 2 : 0) +
                                       (p.z() > 1.2 ? 4 : 0))];
  }
  // The same shares by counting a fine lattice.
  std::vector<double> truth(8, 0.0);
  double all = 0.0;
  for (double x = 0.02; x < 4.0; x += 0.04) {
    for (double y = 0.02; y < 3.0; y += 0.04) {
      for (double z = 0.02; z < 2.4; z += 0.04) {
        if (test::furnishedRoom({x, y, z}) < 0.1) continue;
        truth[static_cast<std::size_t>((x > 2.0 ? 1 : 0) + (y > 1.5 ? 2 : 0) + (z > 1.2 ? 4 : 0))] += 1.0;
        all += 1.0;
      }
    }
  }
  for (std::size_t n = 0; n < 8; ++n) EXPECT_NEAR(eighths[n] / 4000.0, truth[n] / all, 0.02);
}

TEST_F(StartsOverMapTest, PointEverywhereWithoutAHint) {
  Eigen::Matrix3d mean = Eigen::Matrix3d::Zero();
  for (const auto& T : startsOverMap(*field_, *field_, std::nullopt, 0.1, 4000, 1)) {
    EXPECT_NEAR(T.linear().determinant(), 1.0, 1e-9);
    mean += T.linear() / 4000.0;
  }
  EXPECT_LT(mean.cwiseAbs().maxCoeff(), 0.05) << "uniform rotations have mean zero";
}

TEST_F(StartsOverMapTest, HangStraightWithAHint) {
  const GravityHint hint{Eigen::Vector3d(0.0, 1.0, 0.2).normalized(), -Eigen::Vector3d::UnitZ(), 0.1};
  std::vector<int> yaw(12, 0);
  for (const auto& T : startsOverMap(*field_, *field_, hint, 0.1, 1200, 1)) {
    const double tilt = std::acos(std::clamp((T.linear() * hint.down_sensor).dot(hint.down_map), -1.0, 1.0));
    EXPECT_LT(tilt, 0.4);
    const Eigen::Vector3d ahead = T.linear() * hint.down_sensor.unitOrthogonal();
    ++yaw[static_cast<std::size_t>(
        std::floor((std::atan2(ahead.y(), ahead.x()) + M_PI) / (2.0 * M_PI) * 11.999))];
  }
  for (const int count : yaw) EXPECT_NEAR(count, 100, 40);
}

TEST(StartsOverMap, AreNoneWhereNothingIsFree) {
  const auto solid = test::denseField([](const Eigen::Vector3d&) { return -1.0; }, test::roomGeometry(0.2));
  EXPECT_TRUE(startsOverMap(*solid, *solid, std::nullopt, 0.1, 100, 1).empty());
}

}  // namespace
}  // namespace ttsdf
