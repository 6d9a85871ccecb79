// Maps with coordinates of a survey (UTM): five million metres from zero, where single precision ends at half
// a metre.

#include <gtest/gtest.h>

#include "analytic_world.h"
#include "ttsdf_localization/compression/tt_svd.h"
#include "ttsdf_localization/map/tt_sdf_map.h"
#include "ttsdf_localization/registration/search.h"

namespace ttsdf::test {
namespace {

const Eigen::Vector3d kUtm(356789.123, 5412345.678, 122.956);

TtSdfMap roomAt(const Eigen::Vector3d& place) {
  TtSdfMap map;
  map.geometry = roomGeometry();
  TtSvdOptions options;
  options.max_rank1 = options.max_rank2 = 40;
  map.train = ttSvd(sampled(furnishedRoom, map.geometry), options).train;
  map.geometry.T_map_grid.translation() += place;
  map.truncation = 0.15;
  return map;
}

Eigen::Isometry3d moved(Eigen::Isometry3d T, const Eigen::Vector3d& by) {
  T.translation() += by;
  return T;
}

class FarOrigin : public ::testing::Test {
 protected:
  FarOrigin() : truth_(Eigen::Isometry3d::Identity()) {
    truth_.translation() << 1.3, 2.0, 1.4;
    truth_.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 0.3).normalized()).toRotationMatrix();
    scan_ = castRays(furnishedRoom, truth_, directions(1500));
  }
  Eigen::Isometry3d truth_;
  ScanPoints scan_;
};

TEST_F(FarOrigin, FieldsAnswerRelativeToTheirOrigin) {
  const auto near = makeField(roomAt(Eigen::Vector3d::Zero())), far = makeField(roomAt(kUtm));
  EXPECT_TRUE(near->geometry().origin.isZero());
  EXPECT_LT((far->geometry().origin - kUtm).norm(), 10.0);
  const Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, 200).array() + 1.2;
  const FieldSamples a = near->evaluate(points.cast<float>());
  const FieldSamples b =
      far->evaluate(((points.colwise() + kUtm).colwise() - far->geometry().origin).cast<float>().eval());
  EXPECT_EQ(a.states, b.states);
  EXPECT_LT((a.values - b.values).cwiseAbs().maxCoeff(), 1e-5F);
}

TEST_F(FarOrigin, EveryModeFindsThePose) {
  Registration near(makeField(roomAt(Eigen::Vector3d::Zero()))), far(makeField(roomAt(kUtm)));
  Eigen::Isometry3d prior = truth_;
  prior.translation() += Eigen::Vector3d(0.1, -0.08, 0.05);
  const auto expectTruth = [&](const RegistrationResult& result, const Eigen::Vector3d& place) {
    EXPECT_TRUE(result.success) << name(result.reason);
    EXPECT_LT(poseError(moved(truth_, place), result.T_map_sensor).translation, 0.01);
    EXPECT_LT(poseError(moved(truth_, place), result.T_map_sensor).rotation, 0.01);
    EXPECT_LT(result.covariance.diagonal().tail<3>().maxCoeff(), 1e-2);  // about the sensor, not about zero
  };
  expectTruth(near.align(scan_, prior), Eigen::Vector3d::Zero());
  expectTruth(far.align(scan_, moved(prior, kUtm)), kUtm);
  expectTruth(searchNear(far, scan_, moved(prior, kUtm), SearchOptions()), kUtm);
  const Eigen::Vector3d down = truth_.linear().transpose() * Eigen::Vector3d(0, 0, -1);
  expectTruth(localizeGlobally(far, scan_, down, Eigen::Vector3d(0, 0, -1), GlobalOptions()), kUtm);
}

}  // namespace
}  // namespace ttsdf::test
