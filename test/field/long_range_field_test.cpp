#include "ttsdf_localization/field/long_range_field.h"

#include <gtest/gtest.h>

#include "../registration/analytic_world.h"

namespace ttsdf {
namespace {

constexpr double kVoxel = 0.05;
const Eigen::Vector3d kCentre(1.9, 1.6, 1.1);

double ball(const Eigen::Vector3d& p) { return (p - kCentre).norm() - 0.8; }

/// Distances as a map stores them: exact near the surface, clamped further out.
double clampedBall(const Eigen::Vector3d& p) { return std::clamp(ball(p), -0.1, 0.2); }

TEST(LongRangeField, IsTheDistanceToTheSurfaceFarBeyondTheClamp) {
  const auto map = test::denseField(clampedBall, test::roomGeometry(kVoxel));
  const auto field = makeLongRangeField(*map);
  ASSERT_NE(field, nullptr);
  const GridGeometry& geometry = field->geometry();
  double worst = 0.0;
  for (int k = 0; k < geometry.dims[2]; ++k) {
    for (int j = 0; j < geometry.dims[1]; ++j) {
      for (int i = 0; i < geometry.dims[0]; ++i) {
        const double truth = ball(geometry.samplePosition(Eigen::Vector3d(i, j, k)));
        worst = std::max(worst, std::abs(field->tensor()(i, j, k) - truth));
      }
    }
  }
  EXPECT_LT(worst, kVoxel) << "exact to about a voxel of the map";
}

TEST(LongRangeField, ReachesBeyondTheMap) {
  const auto map = test::denseField(clampedBall, test::roomGeometry(kVoxel));
  LongRangeOptions options;
  options.padding = 1.5;
  const auto field = makeLongRangeField(*map, options);
  ASSERT_NE(field, nullptr);
  const Eigen::Vector3f outside(-1.7f, 1.0f, 1.0f);
  EXPECT_EQ(map->evaluate(Eigen::Matrix3Xf(outside)).states[0], PointState::kOutside);
  const FieldSamples samples = field->evaluate(Eigen::Matrix3Xf(outside));
  EXPECT_EQ(samples.states[0], PointState::kValid);
  EXPECT_NEAR(samples.values[0], ball(outside.cast<double>()), kVoxel);
}

TEST(LongRangeField, KeepsTheNumberOfSamples) {
  const auto map = test::denseField(clampedBall, test::roomGeometry(kVoxel));
  LongRangeOptions options;
  options.max_samples = 2000;
  const auto field = makeLongRangeField(*map, options);
  ASSERT_NE(field, nullptr);
  EXPECT_LE(field->tensor().size(), 2000u);
}

TEST(LongRangeField, IsNoneWithoutASurface) {
  EXPECT_EQ(makeLongRangeField(
                *test::denseField([](const Eigen::Vector3d&) { return 0.2; }, test::roomGeometry(0.2))),
            nullptr);
}

TEST(LongRangeField, TrustsNoSurfaceThatTheMapDoesNotSupport) {
  const GridGeometry geometry = test::roomGeometry(kVoxel);
  EXPECT_EQ(
      makeLongRangeField(*test::denseField(clampedBall, geometry, SupportMask(geometry.dims, 4, false))),
      nullptr);
}

}  // namespace
}  // namespace ttsdf
