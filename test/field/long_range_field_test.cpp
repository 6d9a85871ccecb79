#include "ttsdf_localization/field/long_range_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "../registration/analytic_world.h"

namespace ttsdf {
namespace {

constexpr double kVoxel = 0.05;
const Eigen::Vector3d kCentre(1.9, 1.6, 1.1);

double ball(const Eigen::Vector3d& p) { return (p - kCentre).norm() - 0.8; }

/// Distances as a map stores them: exact near the surface, clamped further out.
double clampedBall(const Eigen::Vector3d& p) { return std::clamp(ball(p), -0.1, 0.2); }

/// Largest error over a lattice that reaches `beyond` outside of the map's box, and of the gradient's length.
struct Errors {
  double value = 0.0, slope = 0.0;
  int wrong_signs = 0, points = 0;
};

template <class Distance>
Errors compare(const DistanceField& field, const GridGeometry& map, double beyond, const Distance& distance) {
  Errors errors;
  const double step = 0.11;
  const Eigen::Array3d size = (map.dims - 1).cast<double>() * map.voxel_size + 2.0 * beyond;
  const Dims counts = (size / step).cast<int>();
  for (int n = 0; n < counts.prod(); ++n) {
    const Eigen::Array3d place(n % counts[0], n / counts[0] % counts[1], n / counts[0] / counts[1]);
    const Eigen::Vector3d p = map.T_map_grid * (step * place - beyond).matrix();
    const FieldSamples s = field.evaluate(Eigen::Matrix3Xf(p.cast<float>()));
    EXPECT_EQ(s.states[0], PointState::kValid);
    const double truth = distance(p);
    ++errors.points;
    errors.value = std::max(errors.value, std::abs(s.values[0] - truth));
    errors.slope = std::max(errors.slope, static_cast<double>(s.gradients.col(0).norm()));
    if (std::abs(truth) > 2.0 * kVoxel && (s.values[0] < 0.0f) != (truth < 0.0)) ++errors.wrong_signs;
  }
  return errors;
}

TEST(LongRangeField, IsTheDistanceToTheSurfaceFarBeyondTheClamp) {
  const auto map = test::denseField(clampedBall, test::roomGeometry(kVoxel));
  const auto field = makeLongRangeField(*map);
  ASSERT_NE(field, nullptr);
  const Errors errors = compare(*field, map->geometry(), 0.0, ball);
  EXPECT_GT(errors.points, 1000);
  // Exact to about a voxel of the map, but that interpolation between samples four voxels apart rounds off
  // the middle of the ball.
  EXPECT_LT(errors.value, 2.0 * kVoxel);
  EXPECT_LT(errors.slope, 1.3);
  EXPECT_EQ(errors.wrong_signs, 0);
}

TEST(LongRangeField, AtItsSamplesIsExactToAVoxelWhateverTheirSpacing) {
  // Distances end two voxels behind the surface, as maps have it: wide cells are not told by their corners
  // alone.
  const auto map = test::denseField(clampedBall, test::roomGeometry(kVoxel));
  for (const int spacing : {1, 2, 3, 5, 6, 8, 12}) {
    LongRangeOptions options;
    options.spacing_voxels = spacing;
    const auto field = makeLongRangeField(*map, options);
    ASSERT_NE(field, nullptr);
    const GridGeometry& g = field->geometry();
    const Eigen::Vector3d low = map->geometry().samplePosition(Eigen::Vector3d::Zero()),
                          high = map->geometry().samplePosition(
                              (map->geometry().dims - 1).cast<double>().matrix());
    for (int n = 0; n < g.dims.prod(); ++n) {
      const Dims at(n % g.dims[0], n / g.dims[0] % g.dims[1], n / g.dims[0] / g.dims[1]);
      const Eigen::Vector3d p = g.samplePosition(at.cast<double>().matrix());
      if ((p.array() > high.array() + 1e-6).any() || (p.array() < low.array() - 1e-6).any()) continue;
      const FieldSamples s = field->evaluate(Eigen::Matrix3Xf(p.cast<float>()));
      // Nearest points that are handed on from sample to sample are wrong by up to a tenth of the grid's
      // spacing.
      EXPECT_NEAR(s.values[0], ball(p), kVoxel + 0.1 * g.voxel_size) << spacing << ": " << at.transpose();
    }
  }
}

TEST(LongRangeField, GoesOnOutsideOfTheMap) {
  const auto map = test::denseField(clampedBall, test::roomGeometry(kVoxel));
  const auto field = makeLongRangeField(*map);
  ASSERT_NE(field, nullptr);
  const Errors errors = compare(*field, map->geometry(), 1.5, ball);
  EXPECT_LT(errors.value, 0.2) << "of up to three metres";
  EXPECT_LT(errors.slope, 1.3);
  EXPECT_EQ(errors.wrong_signs, 0);
}

TEST(LongRangeField, WhatLiesBehindAWallAtTheBoxIsBehindItOutsideToo) {
  // A wall two voxels inside of the box: a sign that ended with the box would put a second surface behind it.
  const GridGeometry geometry = test::roomGeometry(kVoxel);
  const double wall = geometry.samplePosition(Eigen::Vector3d(2, 0, 0)).x();
  const auto behind = [wall](const Eigen::Vector3d& p) { return p.x() - wall; };
  // Of the wall the map knows what is in its box; beyond its edges the way there is longer.
  const Eigen::Vector3d low = geometry.samplePosition(Eigen::Vector3d::Zero()),
                        high = geometry.samplePosition((geometry.dims - 1).cast<double>().matrix());
  const auto to_wall = [&](const Eigen::Vector3d& p) {
    Eigen::Vector3d foot = p.cwiseMax(low).cwiseMin(high);
    foot.x() = wall;
    return p.x() < wall ? -(p - foot).norm() : (p - foot).norm();
  };
  const auto map =
      test::denseField([&](const Eigen::Vector3d& p) { return std::clamp(behind(p), -0.1, 0.2); }, geometry);
  const auto field = makeLongRangeField(*map);
  ASSERT_NE(field, nullptr);
  const Errors errors = compare(*field, geometry, 0.5, to_wall);
  EXPECT_LT(errors.value, 2.0 * kVoxel);
  EXPECT_LT(errors.slope, 1.3);
  EXPECT_EQ(errors.wrong_signs, 0);
}

TEST(LongRangeField, KeepsTheNumberOfSamplesAndTheBytes) {
  const auto map = test::denseField(clampedBall, test::roomGeometry(kVoxel));
  LongRangeOptions options;
  options.max_samples = 2000;
  const auto field = makeLongRangeField(*map, options);
  ASSERT_NE(field, nullptr);
  EXPECT_LE(field->geometry().voxelCount(), 2000u);
  EXPECT_EQ(field->memoryBytes(), LongRangeField::bytesFor(map->geometry(), options));
  EXPECT_EQ(makeLongRangeField(*map)->memoryBytes(), LongRangeField::bytesFor(map->geometry()));
}

TEST(LongRangeField, FarPointsAndNumbersThatAreNoneAreOutside) {
  const auto map = test::denseField(clampedBall, test::roomGeometry(kVoxel));
  const auto field = makeLongRangeField(*map);
  ASSERT_NE(field, nullptr);
  for (const float x : {1e9f, -1e30f, std::numeric_limits<float>::infinity(), std::nanf("")}) {
    const FieldSamples s = field->evaluate(Eigen::Matrix3Xf(Eigen::Vector3f(x, 1.0f, 1.0f)));
    EXPECT_EQ(s.states[0], PointState::kOutside) << x;
    EXPECT_EQ(s.values[0], 0.0f);
  }
}

TEST(LongRangeField, CanBeCancelled) {
  const auto map = test::denseField(clampedBall, test::roomGeometry(kVoxel));
  EXPECT_THROW(makeLongRangeField(*map, {}, [] { return false; }), Cancelled);
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
