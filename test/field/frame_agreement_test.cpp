#include "ttsdf_localization/field/frame_agreement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

namespace ttsdf {
namespace {

TEST(FrameAgreement, UnknownAddsNothing) {
  FrameAgreement agreement;
  agreement.shift = 0.01;
  const Matrix6d scan = Matrix6d::Identity();
  EXPECT_EQ(withMapErrors(agreement, scan, scan, {0, 0, 2}), scan);
}

TEST(FrameAgreement, CovarianceIsThatOfItsErrors) {
  FrameAgreement agreement;
  agreement.compared = 10;
  agreement.shift = 0.01, agreement.turn_sensor = 0.006, agreement.turn_scene = 0.003;
  const Eigen::Vector3d lever(0.3, -0.4, 2.0);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const auto vector = [&](double sigma) -> Eigen::Vector3d {
    return sigma * Eigen::Vector3d(normal(random), normal(random), normal(random));
  };
  Matrix6d sum = Matrix6d::Zero();
  constexpr int kDraws = 200000;
  for (int n = 0; n < kDraws; ++n) {
    const Eigen::Vector3d shift = vector(0.01), sensor = vector(0.006), scene = vector(0.003);
    Vector6d twist;  // about the sensor: a turn about the middle of what is seen moves it
    twist << sensor + scene, shift - scene.cross(lever);
    sum += twist * twist.transpose();
  }
  const Matrix6d wanted = sum / kDraws,
                 got = withMapErrors(agreement, Matrix6d::Identity(), Matrix6d::Zero(), lever);
  EXPECT_LT((got - wanted).cwiseAbs().maxCoeff(), 0.02 * wanted.cwiseAbs().maxCoeff());
}

TEST(FrameAgreement, WidensWhatAScanTells) {
  FrameAgreement agreement;
  agreement.compared = 10;
  agreement.widening = 1.5;
  const Matrix6d scan = 4.0 * Matrix6d::Identity();
  EXPECT_LT((withMapErrors(agreement, scan, scan, {0, 0, 2}) - 9.0 * Matrix6d::Identity()).norm(), 1e-12);
  // A prior as sure as the scan: half of the scan's errors are left, and half of what the map does to it.
  const Matrix6d posterior = 2.0 * Matrix6d::Identity();
  const Matrix6d wanted = (2.0 + 0.25 * (9.0 - 4.0)) * Matrix6d::Identity();
  EXPECT_LT((withMapErrors(agreement, scan, posterior, {0, 0, 2}) - wanted).norm(), 1e-12);
  // Where the scan says nothing, the map's surfaces do nothing.
  const Matrix6d silent = 1e6 * Matrix6d::Identity();
  EXPECT_LT((withMapErrors(agreement, silent, posterior, {0, 0, 2}) - posterior).norm(), 1e-4);
}

TEST(FrameAgreement, VariancesHoldForTheViewpoint) {
  FrameAgreement agreement;
  agreement.compared = 10, agreement.viewpoint_distance = 0.2;
  EXPECT_EQ(varianceRatio(agreement, {}), 1.0);
  const Viewpoint door{{1, 0, 1}, {1, 0, 0}}, window{{-1, 0, 1}, {-1, 0, 0}};
  agreement.viewpoints = {{door, 9, 6.0}, {window, 3, 0.2}};
  // Nine frames against the one that agrees as the whole map does.
  EXPECT_NEAR(varianceRatio(agreement, door), (9 * 6.0 + 1) / 10, 1e-6);
  EXPECT_NEAR(varianceRatio(agreement, window), (3 * 0.2 + 1) / 4, 1e-6);
  EXPECT_NEAR(varianceRatio(agreement, {{1, 0, 1}, {-1, 0, 0}}), 1.0, 1e-6);  // looks the other way
  EXPECT_NEAR(varianceRatio(agreement, {{9, 0, 1}, {1, 0, 0}}), 1.0, 1e-6);   // is elsewhere
  // Half-way between the two distances of one standard deviation.
  const double weight = 9 * std::exp(-0.5);
  EXPECT_NEAR(varianceRatio(agreement, {{1.2, 0, 1}, {1, 0, 0}}), (weight * 6.0 + 1) / (weight + 1), 1e-6);
}

TEST(FrameAgreement, AViewpointScalesAllVariances) {
  FrameAgreement agreement;
  agreement.compared = 10;
  agreement.widening = 1.5, agreement.shift = 0.01, agreement.turn_sensor = 0.006,
  agreement.turn_scene = 0.003;
  const Matrix6d scan = 1e-4 * Matrix6d::Identity();
  const Eigen::Vector3d lever(0.3, -0.4, 2.0);
  const Matrix6d everywhere = withMapErrors(agreement, scan, scan, lever);
  EXPECT_LT((withMapErrors(agreement, scan, scan, lever, 3.0) - 3.0 * everywhere).norm(), 1e-12);
  // Never surer than the scan itself.
  agreement.shift = agreement.turn_sensor = agreement.turn_scene = 0.0;
  EXPECT_LT((withMapErrors(agreement, scan, scan, lever, 0.1) - scan).norm(), 1e-12);
}

TEST(FrameAgreement, ViewpointIsThePositionAndTheMeanDirection) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translate(Eigen::Vector3d(1, 2, 3)).rotate(Eigen::AngleAxisd(0.5 * M_PI, Eigen::Vector3d::UnitZ()));
  Eigen::Matrix3Xf points(3, 4);
  points << 5, 0, std::numeric_limits<float>::quiet_NaN(), 0, 0, 0.1F, 1, 0, 0, 0, 1, 0;
  const Viewpoint viewpoint = viewpointOf(points, T);
  EXPECT_LT((viewpoint.position - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
  EXPECT_LT((viewpoint.view - Eigen::Vector3d(-0.5, 0.5, 0)).norm(), 1e-6);  // of (1,0,0) and (0,1,0), turned
}

TEST(FrameAgreement, NumbersThatCannotBeAreRefused) {
  FrameAgreement agreement;
  agreement.shift = -0.1;
  EXPECT_THROW(check(agreement), std::invalid_argument);
  agreement.shift = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(check(agreement), std::invalid_argument);
  agreement.shift = 0.0;
  agreement.widening = 0.9;
  EXPECT_THROW(check(agreement), std::invalid_argument);
  agreement.widening = 1.0;
  agreement.compared = -1;
  EXPECT_THROW(check(agreement), std::invalid_argument);
  agreement.compared = 1;
  agreement.viewpoints = {{}};
  EXPECT_THROW(check(agreement), std::invalid_argument);  // no distance
  agreement.viewpoint_distance = 0.2;
  EXPECT_NO_THROW(check(agreement));
  agreement.viewpoints[0].frames = 0;
  EXPECT_THROW(check(agreement), std::invalid_argument);
  agreement.viewpoints[0].frames = 1, agreement.viewpoints[0].ratio = 0.0;
  EXPECT_THROW(check(agreement), std::invalid_argument);
  EXPECT_NO_THROW(check(FrameAgreement()));
}

}  // namespace
}  // namespace ttsdf
