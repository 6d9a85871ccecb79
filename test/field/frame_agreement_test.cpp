#include "ttsdf_localization/field/frame_agreement.h"

#include <gtest/gtest.h>

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
  EXPECT_NO_THROW(check(FrameAgreement()));
}

}  // namespace
}  // namespace ttsdf
