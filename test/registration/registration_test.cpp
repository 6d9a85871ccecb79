// Registration against worlds whose distance is known in closed form.

#include "ttsdf_localization/registration/registration.h"

#include <gtest/gtest.h>

#include <limits>

#include "analytic_world.h"
#include "ttsdf_localization/compression/tt_svd.h"
#include "ttsdf_localization/field/tt_distance_field.h"

namespace ttsdf {
namespace {

using test::castRays;
using test::denseField;
using test::furnishedRoom;
using test::perturbed;
using test::roomGeometry;
using test::roomPose;

constexpr double kVoxel = 0.05;

std::shared_ptr<const DistanceField> compressedField(const test::Sdf& sdf, const GridGeometry& geometry,
                                                     int rank) {
  TtSvdOptions options;
  options.max_rank1 = options.max_rank2 = rank;
  return std::make_shared<TtDistanceField>(ttSvd(test::sampled(sdf, geometry), options).train, geometry);
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

/// Errors over several poses and perturbations of 0.2 m and 0.1 rad.
struct Errors {
  std::vector<double> translation, rotation;
  int successes = 0;
};
Errors alignMany(Registration& registration, int count) {
  Errors errors;
  for (int n = 0; n < count; ++n) {
    const auto seed = static_cast<unsigned>(n);
    const Eigen::Isometry3d truth = roomPose(seed);
    const Eigen::Matrix3Xf points = castRays(furnishedRoom, truth, test::directions(1500));
    const RegistrationResult result = registration.align(points, perturbed(truth, 0.2, 0.1, seed + 100));
    const PoseError error = poseError(truth, result.T_map_sensor);
    errors.translation.push_back(error.translation);
    errors.rotation.push_back(error.rotation);
    errors.successes += result.success ? 1 : 0;
    EXPECT_EQ(result.degenerate_directions, 0);
    EXPECT_EQ(result.points, points.cols());
    EXPECT_GT(result.iterations, 0);
    EXPECT_GT(result.milliseconds, 0.0);
  }
  return errors;
}

TEST(Registration, FindsNoiseFreeScansOfARoomWithinATwentiethOfAVoxel) {
  for (const int rank : {1000, 40}) {
    Registration registration(compressedField(furnishedRoom, roomGeometry(kVoxel), rank));
    const Errors errors = alignMany(registration, 15);
    EXPECT_EQ(errors.successes, 15) << rank;
    EXPECT_LT(median(errors.translation), 0.05 * kVoxel) << rank;
    EXPECT_LT(median(errors.rotation), 0.05 * kVoxel) << rank << ": radians at one metre";
    for (const double error : errors.translation) EXPECT_LT(error, kVoxel) << rank;
  }
}

TEST(Registration, NarrowsTheKernelWhereAScanFitsWell) {
  // A fifth of the points lies 2 cm behind its surface, all on one side: within the widest kernel, but far
  // out for a scan without noise. Noise as large as that keeps the kernel wide.
  const auto field = compressedField(furnishedRoom, roomGeometry(kVoxel), 1000);
  RegistrationOptions wide;
  wide.kernel_scale_end = wide.kernel_scale_least = 2.5 * kVoxel;
  Registration narrows(field), stays(field, wide);
  for (const double noise : {0.0, 0.02}) {
    std::vector<double> narrow_errors, wide_errors;
    for (unsigned seed = 0; seed < 15; ++seed) {
      const Eigen::Isometry3d truth = roomPose(seed);
      Eigen::Matrix3Xf points = castRays(furnishedRoom, truth, test::directions(1500), noise, seed);
      for (Eigen::Index n = 0; n < points.cols(); ++n) {
        const Eigen::Vector3f ray = points.col(n).normalized();
        if ((truth.linear() * ray.cast<double>()).x() > 0.6) points.col(n) += 0.02f * ray;
      }
      const Eigen::Isometry3d prior = perturbed(truth, 0.1, 0.05, seed + 100);
      narrow_errors.push_back(poseError(truth, narrows.align(points, prior).T_map_sensor).translation);
      wide_errors.push_back(poseError(truth, stays.align(points, prior).T_map_sensor).translation);
    }
    if (noise == 0.0) {
      EXPECT_LT(median(narrow_errors), 0.5 * median(wide_errors));
    } else {
      EXPECT_LT(median(narrow_errors), 1.1 * median(wide_errors));
    }
  }
}

TEST(Registration, StaysWithinAVoxelAtLowRank) {
  Registration registration(compressedField(furnishedRoom, roomGeometry(kVoxel), 15));
  const Errors errors = alignMany(registration, 10);
  EXPECT_EQ(errors.successes, 10);
  for (const double error : errors.translation) EXPECT_LT(error, kVoxel);
}

TEST(Registration, GaussNewtonOfThePaperFindsTheRoomFromNearby) {
  TtFieldOptions nearest;
  nearest.interpolation = Interpolation::kNearest;
  const GridGeometry geometry = roomGeometry(kVoxel);
  const auto field = std::make_shared<TtDistanceField>(
      ttSvd(test::sampled(furnishedRoom, geometry), {}).train, geometry, SupportMask(), nearest);
  RegistrationOptions options;
  options.method = "gauss_newton";
  Registration registration(field, options);
  for (unsigned seed = 0; seed < 8; ++seed) {
    const Eigen::Isometry3d truth = roomPose(seed);
    const RegistrationResult result = registration.align(
        castRays(furnishedRoom, truth, test::directions(1500)), perturbed(truth, 0.05, 0.02, seed));
    EXPECT_LT(poseError(truth, result.T_map_sensor).translation, kVoxel) << seed;
  }
}

TEST(Registration, ConfidenceTellsRightFromWrong) {
  Registration registration(compressedField(furnishedRoom, roomGeometry(kVoxel), 40));
  const auto ball = [](const Eigen::Vector3d& p) {
    return 1.1 - (p - Eigen::Vector3d(2.0, 1.5, 1.2)).norm();
  };
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Eigen::Isometry3d truth = roomPose(seed);
    const RegistrationResult right = registration.align(
        castRays(furnishedRoom, truth, test::directions(1500), 0.005), perturbed(truth, 0.1, 0.05, seed));
    EXPECT_TRUE(right.success);
    EXPECT_GT(right.confidence, 0.9) << seed;
    const Eigen::Isometry3d T(Eigen::Translation3d(2.0, 1.5, 1.2));
    const RegistrationResult wrong = registration.align(
        castRays(ball, T, test::directions(1500), 0.005, seed), perturbed(T, 0.1, 0.05, seed));
    EXPECT_FALSE(wrong.success);
    EXPECT_LT(wrong.confidence, 0.1) << seed;
  }
}

class RegistrationOnBadInput : public testing::Test {
 protected:
  const std::shared_ptr<const DistanceField> field_ = denseField(furnishedRoom, roomGeometry(kVoxel));
  const Eigen::Isometry3d truth_ = roomPose(1);
  const Eigen::Matrix3Xf points_ = castRays(furnishedRoom, truth_, test::directions(1000));
};

TEST_F(RegistrationOnBadInput, PointsThatAreNoneAreIgnored) {
  Registration registration(field_);
  Eigen::Matrix3Xf dirty(3, 2 * points_.cols());
  const float bad[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                       1e30f};
  for (Eigen::Index n = 0; n < points_.cols(); ++n) {
    dirty.col(2 * n) = points_.col(n);
    dirty.col(2 * n + 1) = points_.col(n);
    dirty(n % 3, 2 * n + 1) = bad[n % 3];
  }
  const Eigen::Isometry3d prior = perturbed(truth_, 0.1, 0.05, 1);
  const RegistrationResult clean = registration.align(points_, prior),
                           result = registration.align(dirty, prior);
  EXPECT_EQ(result.points, points_.cols());
  EXPECT_EQ(result.T_map_sensor.matrix(), clean.T_map_sensor.matrix());
}

TEST_F(RegistrationOnBadInput, TooFewPointsAreRefused) {
  Registration registration(field_);
  for (const int count : {0, 1, 5, 49}) {
    const RegistrationResult result = registration.align(points_.leftCols(count), truth_);
    EXPECT_EQ(result.reason, TerminationReason::kTooFewPoints) << count;
    EXPECT_FALSE(result.success);
    EXPECT_EQ(result.points, count);
    EXPECT_EQ(result.T_map_sensor.matrix(), truth_.matrix()) << "the prior is handed back";
  }
  const Eigen::Matrix3Xf nothing =
      Eigen::Matrix3Xf::Constant(3, 500, std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(registration.align(nothing, truth_).reason, TerminationReason::kTooFewPoints);
}

TEST_F(RegistrationOnBadInput, AScanOutsideTheMapIsSaidToBe) {
  for (const char* method : {"robust", "gauss_newton"}) {
    RegistrationOptions options;
    options.method = method;
    Registration registration(field_, options);
    Eigen::Isometry3d far = truth_;
    far.translation().x() += 100.0;
    const RegistrationResult result = registration.align(points_, far);
    EXPECT_EQ(result.reason, TerminationReason::kOutsideMap) << method;
    EXPECT_FALSE(result.success);
    EXPECT_EQ(result.outside_ratio, 1.0);
    EXPECT_TRUE(result.T_map_sensor.matrix().allFinite());
  }
}

TEST_F(RegistrationOnBadInput, AScanInUnknownSpaceSaysNothing) {
  const GridGeometry geometry = roomGeometry(kVoxel);
  for (const char* method : {"robust", "gauss_newton"}) {
    RegistrationOptions options;
    options.method = method;
    Registration registration(denseField(furnishedRoom, geometry, SupportMask(geometry.dims, 4, false)),
                              options);
    const RegistrationResult result = registration.align(points_, truth_);
    EXPECT_EQ(result.reason, TerminationReason::kOutsideMap) << method;
    EXPECT_FALSE(result.success);
    EXPECT_EQ(result.unknown_ratio, 1.0);
    EXPECT_EQ(result.outside_ratio, 0.0);
  }
}

TEST_F(RegistrationOnBadInput, TheScoreTellsAScanOfAnotherPlace) {
  // The inside of a ball of 1.1 m: nothing in the room is curved like that.
  const auto ball = [](const Eigen::Vector3d& p) {
    return 1.1 - (p - Eigen::Vector3d(2.0, 1.5, 1.2)).norm();
  };
  Registration registration(field_);
  const Eigen::Isometry3d T(Eigen::Translation3d(2.0, 1.5, 1.2));
  const RegistrationResult wrong = registration.align(castRays(ball, T, test::directions(1000)), T),
                           right = registration.align(points_, perturbed(truth_, 0.1, 0.05, 1));
  EXPECT_GT(wrong.score, registration.options().restart_score);
  EXPECT_LT(right.score, 0.1 * registration.options().restart_score);
  EXPECT_LT(wrong.inlier_ratio, 0.5 * right.inlier_ratio);
}

TEST_F(RegistrationOnBadInput, APriorThatIsNotFiniteIsRefusedWithoutThrowing) {
  Registration registration(field_);
  Eigen::Isometry3d prior = truth_;
  prior.translation().y() = std::nan("");
  const RegistrationResult result = registration.align(points_, prior);
  EXPECT_FALSE(result.success);
}

TEST_F(RegistrationOnBadInput, OptionsOutOfRangeAreRefused) {
  EXPECT_THROW(Registration(nullptr), std::invalid_argument);
  const auto refused = [&](auto change) {
    RegistrationOptions options;
    change(options);
    EXPECT_THROW(Registration(field_, options), std::invalid_argument);
  };
  refused([](RegistrationOptions& o) { o.method = "icp"; });
  refused([](RegistrationOptions& o) { o.max_iterations = 0; });
  refused([](RegistrationOptions& o) { o.kernel_scale_end = -1.0; });
  refused([](RegistrationOptions& o) { o.kernel_scale_end = 3.0, o.kernel_scale_start = 2.0; });
  refused([](RegistrationOptions& o) { o.min_points = 5; });
  refused([](RegistrationOptions& o) { o.inlier_distance = std::nan(""); });
}

TEST(Registration, RepeatsItselfToTheBit) {
  // Over a fresh field and one whose caches are full of other things.
  const auto fresh = compressedField(furnishedRoom, roomGeometry(kVoxel), 30),
             used = compressedField(furnishedRoom, roomGeometry(kVoxel), 30);
  Registration a(fresh), b(used);
  for (unsigned seed = 5; seed < 8; ++seed) {
    b.align(castRays(furnishedRoom, roomPose(seed), test::directions(500)), roomPose(seed));
  }
  const Eigen::Isometry3d truth = roomPose(2), prior = perturbed(truth, 0.2, 0.1, 2);
  const Eigen::Matrix3Xf points = castRays(furnishedRoom, truth, test::directions(1500));
  const RegistrationResult first = a.align(points, prior), second = b.align(points, prior);
  EXPECT_EQ(first.T_map_sensor.matrix(), second.T_map_sensor.matrix());
  EXPECT_EQ(first.covariance, second.covariance);
  EXPECT_EQ(first.iterations, second.iterations);
  EXPECT_EQ(first.score, second.score);
}

TEST(Registration, EveryReasonHasItsName) {
  EXPECT_STREQ(name(TerminationReason::kConverged), "converged");
  EXPECT_STREQ(name(TerminationReason::kOutsideMap), "outside_map");
  std::vector<std::string> names;
  for (int n = 0; n <= static_cast<int>(TerminationReason::kCancelled); ++n) {
    names.emplace_back(name(static_cast<TerminationReason>(n)));
  }
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::unique(names.begin(), names.end()), names.end());
}

/// A floor, a side wall, and a thin wall across that was mapped from its far side (x < 2) only: its other
/// face, at x = 2.1, is not in the map.
class OneSidedWall final : public DistanceField {
 public:
  const GridGeometry& geometry() const override { return geometry_; }
  std::size_t memoryBytes() const override { return 0; }
  using DistanceField::evaluate;
  void evaluate(const PointSpan& points, const SampleSpan& samples) const override {
    for (int n = 0; n < points.size; ++n) {
      const float across = points.x[n] < 2.2f ? std::max(2.0f - points.x[n], -0.15f) : 1.0f;
      const float value = std::min({points.z[n], points.y[n], across});
      samples.value[n] = value;
      samples.gradient_x[n] = value == across ? -1.0f : 0.0f;
      samples.gradient_y[n] = value != across && value == points.y[n] ? 1.0f : 0.0f;
      samples.gradient_z[n] = value != across && value != points.y[n] ? 1.0f : 0.0f;
      samples.state[n] = PointState::kValid;
    }
  }

 private:
  GridGeometry geometry_{Dims(100, 100, 100), 0.05, Eigen::Isometry3d::Identity()};
};

TEST(Registration, TheUnmappedFaceOfAThinWallDoesNotPull) {
  ScanPoints points(3, 1500);
  for (int n = 0; n < 500; ++n) {
    const float u = static_cast<float>(n % 25) / 25.0f, v = static_cast<float>(n / 25) / 20.0f;
    points.col(3 * n) << 2.3f + 1.5f * u, 0.3f + 1.5f * v, 0.0f;  // floor
    points.col(3 * n + 1) << 2.3f + 1.5f * u, 0.0f, 0.3f + v;     // side wall
    points.col(3 * n + 2) << 2.1f, 0.3f + 1.5f * u, 0.3f + v;     // the face that is not mapped
  }
  Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
  truth.translation() << 4.0, 1.2, 1.0;
  const ScanPoints scan = truth.inverse().cast<float>() * points;
  RegistrationOptions options;
  options.long_range = false;
  const RegistrationResult held = Registration(std::make_shared<OneSidedWall>(), options).align(scan, truth);
  EXPECT_NEAR(held.behind_ratio, 1.0 / 3.0, 0.01);
  EXPECT_LT(poseError(truth, held.T_map_sensor).translation, 0.002);
  // What the check is for: without it the wall's far face draws the scan to itself.
  options.check_facing = false;
  const RegistrationResult pulled =
      Registration(std::make_shared<OneSidedWall>(), options).align(scan, truth);
  EXPECT_GT(poseError(truth, pulled.T_map_sensor).translation, 0.05);
}

}  // namespace
}  // namespace ttsdf
