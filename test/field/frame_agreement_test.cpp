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
  EXPECT_EQ(mapCovariance(agreement, {0, 0, 2}).norm(), 0.0);
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
    Vector6d twist;  // about the middle of what is seen: a turn about the sensor moves it
    twist << sensor + scene, shift + sensor.cross(lever);
    sum += twist * twist.transpose();
  }
  const Matrix6d wanted = sum / kDraws, got = mapCovariance(agreement, lever);
  EXPECT_LT((got - wanted).cwiseAbs().maxCoeff(), 0.02 * wanted.cwiseAbs().maxCoeff());
}

TEST(FrameAgreement, NumbersThatCannotBeAreRefused) {
  FrameAgreement agreement;
  agreement.shift = -0.1;
  EXPECT_THROW(check(agreement), std::invalid_argument);
  agreement.shift = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(check(agreement), std::invalid_argument);
  agreement.shift = 0.0;
  agreement.compared = -1;
  EXPECT_THROW(check(agreement), std::invalid_argument);
  EXPECT_NO_THROW(check(FrameAgreement()));
}

}  // namespace
}  // namespace ttsdf
