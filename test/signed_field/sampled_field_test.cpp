#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "../support/analytic_observation.h"
#include "ttsdf_localization/signed_field/sampled_field_methods.h"

namespace ttsdf {
namespace {

using testing::Distance;

constexpr double kVoxel = 0.02, kTruncation = 0.06;

Eigen::Vector3d position(const SampledField& field, int i, int j, int k) {
  return field.geometry.samplePosition(Eigen::Vector3d(i, j, k));
}

template <class Function>
void forEachSample(const SampledField& field, const Function& fn) {
  const Dims& dims = field.geometry.dims;
  std::size_t n = 0;
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i, ++n) fn(i, j, k, n, position(field, i, j, k));
    }
  }
}

struct Quality {
  double near_rms = 0.0;    ///< known samples within 1.5 voxels of the surface [voxel]
  double far_rms = 0.0;     ///< known free samples within 0.2 m [voxel]
  int wrong_signs = 0;      ///< of known samples
  int false_crossings = 0;  ///< sign changes between known neighbours away from the true surface
};

/// `sign_tolerance`: how near to the surface a sign may be wrong [voxel].
Quality compare(const SampledField& field, const Distance& truth, double sign_tolerance = 1e-6) {
  Quality quality;
  double near_sum = 0.0, far_sum = 0.0;
  int near_count = 0, far_count = 0;
  const Dims& dims = field.geometry.dims;
  forEachSample(field, [&](int i, int j, int k, std::size_t n, const Eigen::Vector3d& p) {
    if (!field.known[n]) return;
    const double d = truth(p), value = field.values.data()[n], error = (value - d) / kVoxel;
    if (std::abs(d) < 1.5 * kVoxel) near_sum += error * error, ++near_count;
    if (d > 1.5 * kVoxel && d < 0.2) far_sum += error * error, ++far_count;
    if (d * value < 0.0 && std::abs(d) > sign_tolerance * kVoxel) ++quality.wrong_signs;
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Array3i other(i, j, k);
      if (++other[axis] >= dims[axis]) continue;
      const std::size_t m = field.values.offset(other[0], other[1], other[2]);
      if (field.known[m] && value * field.values.data()[m] < 0.0 && std::abs(d) > 1.1 * kVoxel)
        ++quality.false_crossings;
    }
  });
  quality.near_rms = std::sqrt(near_sum / near_count);
  quality.far_rms = std::sqrt(far_sum / far_count);
  return quality;
}

BuildOptions defaults() {
  BuildOptions options;
  options.clamp_negative = 0.06;
  options.clamp_positive = 0.2;
  options.align_axes = false;
  return options;
}

ObservedGrid observeRoom(const Eigen::Isometry3d& T_map_room) {
  const Eigen::Isometry3d T_room_map = T_map_room.inverse();
  return testing::observe([=](const Eigen::Vector3d& p) { return testing::roomDistance(T_room_map * p); },
                          {224, 204, 172}, {-112, -102, -86}, kVoxel, kTruncation);
}

TEST(SampledField, IsExactInARoom) {
  const SampledField field =
      sampleSurfaceDistance(observeRoom(Eigen::Isometry3d::Identity()), defaults(), {});
  BuildOptions unclamped = defaults();
  unclamped.clamp_negative = unclamped.clamp_positive = 0.0;
  const Quality quality =
      compare(sampleSurfaceDistance(observeRoom(Eigen::Isometry3d::Identity()), unclamped, {}),
              testing::roomDistance);
  RecordProperty("near_rms_voxels", std::to_string(quality.near_rms));
  RecordProperty("far_rms_voxels", std::to_string(quality.far_rms));
  EXPECT_LE(quality.near_rms, 0.05);
  EXPECT_LE(quality.far_rms, 0.1);
  EXPECT_EQ(quality.wrong_signs, 0);
  EXPECT_EQ(quality.false_crossings, 0);
  // The clamped field is the same one, cut off.
  const Quality clamped = compare(
      field, [](const Eigen::Vector3d& p) { return std::clamp(testing::roomDistance(p), -0.06, 0.2); });
  EXPECT_LE(clamped.near_rms, 0.05);
  EXPECT_EQ(clamped.wrong_signs, 0);
}

TEST(SampledField, TurnsItsGridToTheRoom) {
  Eigen::Isometry3d T_map_room = Eigen::Isometry3d::Identity();
  T_map_room.linear() =
      (Eigen::AngleAxisd(0.35, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  const Eigen::Isometry3d T_room_map = T_map_room.inverse();
  const auto truth = [&](const Eigen::Vector3d& p) { return testing::roomDistance(T_room_map * p); };
  BuildOptions options = defaults();
  const ObservedGrid observed = observeRoom(T_map_room);
  const SampledField straight = sampleSurfaceDistance(observed, options, {});
  options.align_axes = true;
  options.clamp_positive = options.clamp_negative = 0.0;
  const SampledField turned = sampleSurfaceDistance(observed, options, {});
  const Eigen::AngleAxisd rest(turned.geometry.T_map_grid.linear().transpose() * T_map_room.linear());
  EXPECT_LT(std::abs(rest.angle()) * 180.0 / M_PI, 0.2);
  EXPECT_LT(static_cast<double>(turned.values.size()), 0.85 * static_cast<double>(straight.values.size()));
  // Between the samples of the fusion an edge is known to a fraction of a voxel only.
  const Quality quality = compare(turned, truth, 0.25);
  EXPECT_LE(quality.near_rms, 0.05);
  EXPECT_EQ(quality.wrong_signs, 0);
  EXPECT_EQ(quality.false_crossings, 0);
}

/// Free space x > 0 before the plane x = 0; only |y| < 0.5 was looked at.
TEST(SampledField, KnowsNothingBeyondTheBorderOfAWall) {
  const auto seen = [](const Eigen::Vector3d& p) { return std::abs(p.y()) < 0.5; };
  const ObservedGrid observed = testing::observe([](const Eigen::Vector3d& p) { return p.x(); },
                                                 {60, 120, 60}, {-25, -60, -30}, kVoxel, kTruncation, seen);
  BuildOptions options = defaults();
  options.margin = 0.4;
  const SampledField field = sampleSurfaceDistance(observed, options, {});
  int before = 0, beyond = 0;
  forEachSample(field, [&](int i, int j, int k, std::size_t, const Eigen::Vector3d& p) {
    if (std::abs(p.x()) > 0.1 || std::abs(p.z()) > 0.45) return;
    const bool supported = field.mask.atVoxel(i, j, k);
    // A cell of 4 voxels decides for all of them: 8 cm on either side of the limit stay open.
    if (std::abs(p.y()) < 0.5 - 0.08) {
      ++before;
      EXPECT_TRUE(supported) << p.transpose();
    }
    if (std::abs(p.y()) > 0.5 + options.support_distance + 0.08) {
      ++beyond;
      EXPECT_FALSE(supported) << p.transpose();
    }
  });
  EXPECT_GT(before, 1000);
  EXPECT_GT(beyond, 1000);
}

/// Looking past a wall that was not mapped itself: free space is known, the distance to the unmapped part is
/// not.
TEST(SampledField, FreeSpaceBeforeAnUnmappedWallHasNoSupport) {
  const auto seen = [](const Eigen::Vector3d& p) { return p.y() < 0.0 || p.x() > 0.06; };
  const ObservedGrid observed = testing::observe([](const Eigen::Vector3d& p) { return p.x(); },
                                                 {60, 120, 60}, {-25, -60, -30}, kVoxel, kTruncation, seen);
  BuildOptions options = defaults();
  options.margin = 0.8;
  const SampledField field = sampleSurfaceDistance(observed, options, {});
  int checked = 0;
  forEachSample(field, [&](int i, int j, int k, std::size_t n, const Eigen::Vector3d& p) {
    if (p.y() < 0.3 || p.x() < 0.07 || p.x() > 0.15 || !field.known[n]) return;
    ++checked;
    EXPECT_FALSE(field.mask.atVoxel(i, j, k)) << p.transpose();
  });
  EXPECT_GT(checked, 1000);
}

TEST(SampledField, SpaceOffAConvexEdgeIsSupported) {
  const auto distance = [](const Eigen::Vector3d& p) { return testing::boxDistance(p, {0.3, 0.3, 0.3}); };
  BuildOptions options = defaults();
  const SampledField field = sampleSurfaceDistance(
      testing::observe(distance, {60, 60, 60}, {-30, -30, -30}, kVoxel, kTruncation), options, {});
  forEachSample(field, [&](int i, int j, int k, std::size_t, const Eigen::Vector3d& p) {
    if (distance(p) > 0.0) {
      EXPECT_TRUE(field.mask.atVoxel(i, j, k)) << p.transpose();
    }
  });
}

/// A table seen from above and from the sides only as far as its top reaches: its border ends in observed
/// free space.
TEST(SampledField, ObservedFreeSpaceOffATableEdgeIsSupported) {
  const auto distance = [](const Eigen::Vector3d& p) {
    return testing::boxDistance(p - Eigen::Vector3d(0, 0, -0.5), {0.4, 0.4, 0.5});
  };
  const auto seen = [](const Eigen::Vector3d& p) {
    return p.z() > -0.06 || p.cwiseAbs().head<2>().maxCoeff() > 0.46;
  };
  BuildOptions options = defaults();
  options.margin = 0.3;
  const SampledField field = sampleSurfaceDistance(
      testing::observe(distance, {90, 90, 60}, {-45, -45, -30}, kVoxel, kTruncation, seen), options, {});
  int checked = 0;
  forEachSample(field, [&](int i, int j, int k, std::size_t, const Eigen::Vector3d& p) {
    if (p.z() < 0.0 || p.x() < 0.4 || std::abs(p.y()) > 0.3 || distance(p) > 0.2) return;
    ++checked;
    EXPECT_TRUE(field.mask.atVoxel(i, j, k)) << p.transpose();
  });
  EXPECT_GT(checked, 500);
}

TEST(SampledField, DropsIsolatedCrumbs) {
  const auto distance = [](const Eigen::Vector3d& p) {
    return std::min(p.x(), (p - Eigen::Vector3d(0.3, 0.0, 0.0)).norm() - 0.025);
  };
  const SampledField field = sampleSurfaceDistance(
      testing::observe(distance, {50, 50, 50}, {-10, -25, -25}, kVoxel, 0.02), defaults(), {});
  forEachSample(field, [&](int, int, int, std::size_t n, const Eigen::Vector3d& p) {
    if (field.known[n] && std::abs(p.x() - 0.3) < 0.1) {
      EXPECT_GT(field.values.data()[n], 0.15F) << p.transpose();
    }
  });
}

TEST(SampledField, SaysWhenNothingWasObserved) {
  const ObservedGrid observed = testing::observe([](const Eigen::Vector3d&) { return 1.0; }, {10, 10, 10},
                                                 {0, 0, 0}, kVoxel, kTruncation);
  EXPECT_THROW(sampleSurfaceDistance(observed, defaults(), {}), std::runtime_error);
  EXPECT_THROW(sampleOccupancyDistance(observed, defaults(), {}), std::runtime_error);
  EXPECT_THROW(sampleTruncatedDistance(observed, defaults(), {}), std::runtime_error);
}

TEST(SampledField, CanBeCancelledAtEveryReport) {
  const ObservedGrid observed = testing::observe([](const Eigen::Vector3d& p) { return p.x(); }, {30, 30, 30},
                                                 {-15, -15, -15}, kVoxel, kTruncation);
  int reports = 0;
  double last = -1.0;
  std::string step_now;
  sampleSurfaceDistance(observed, defaults(), [&](const std::string& step, double share) {
    if (step != step_now) step_now = step, last = -1.0;
    EXPECT_GE(share, last);
    EXPECT_LE(share, 1.0);
    last = share;
    ++reports;
    return true;
  });
  EXPECT_GT(reports, 5);
  for (int stop = 0; stop < reports; ++stop) {
    int count = 0;
    EXPECT_THROW(sampleSurfaceDistance(observed, defaults(),
                                       [&](const std::string&, double) { return count++ < stop; }),
                 std::runtime_error);
  }
}

TEST(SampledField, DoesNotDependOnTheThreads) {
  const ObservedGrid observed = observeRoom(Eigen::Isometry3d::Identity());
  BuildOptions options = defaults();
  options.threads = 1;
  const SampledField one = sampleSurfaceDistance(observed, options, {});
  options.threads = 2;
  const SampledField two = sampleSurfaceDistance(observed, options, {});
  EXPECT_TRUE(std::equal(one.values.data(), one.values.data() + one.values.size(), two.values.data()));
  EXPECT_EQ(one.mask.bits(), two.mask.bits());
}

TEST(OccupancyDistance, OfNegativeSamplesEqualsBruteForce) {
  const auto distance = [](const Eigen::Vector3d& p) {
    return (p - Eigen::Vector3d(0.05, 0.01, -0.02)).norm() - 0.13;
  };
  const ObservedGrid observed =
      testing::observe(distance, {24, 22, 20}, {-10, -11, -10}, kVoxel, kTruncation);
  BuildOptions options = defaults();
  options.clamp_negative = options.clamp_positive = 0.0;
  options.margin = 1.0;
  options.sdf_method = "occupancy_edt_negative";
  const SampledField field = sampleOccupancyDistance(observed, options, {});
  const auto occupied = [&](const Eigen::Vector3d& p) {
    const double d = distance(p);
    return d < 0.0 && d >= -kTruncation;
  };
  forEachSample(field, [&](int, int, int, std::size_t n, const Eigen::Vector3d& p) {
    double nearest = 1e9;
    forEachSample(field, [&](int, int, int, std::size_t, const Eigen::Vector3d& q) {
      if (occupied(p) != occupied(q)) nearest = std::min(nearest, (p - q).norm());
    });
    ASSERT_NEAR(field.values.data()[n], occupied(p) ? -nearest : nearest, 1e-5);
  });
}

// The ball's sphere crosses the grid's edges; occupied is the end of the edge that is nearer to it.
TEST(OccupancyDistance, OfCrossingSamplesEqualsBruteForce) {
  const auto distance = [](const Eigen::Vector3d& p) {
    return (p - Eigen::Vector3d(0.053, 0.011, -0.022)).norm() - 0.13;
  };
  const ObservedGrid observed =
      testing::observe(distance, {24, 22, 20}, {-10, -11, -10}, kVoxel, kTruncation);
  BuildOptions options = defaults();
  options.clamp_negative = options.clamp_positive = 0.0;
  options.margin = 1.0;
  const auto occupied = [&](const Eigen::Vector3d& p) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double side : {-kVoxel, kVoxel}) {
        const double here = distance(p), there = distance(p + side * Eigen::Vector3d::Unit(axis));
        if ((here < 0.0) != (there < 0.0) && std::abs(here) <= std::abs(there)) return true;
      }
    }
    return false;
  };
  for (const char* method : {"occupancy_edt", "occupancy_edt_signed"}) {
    options.sdf_method = method;
    const SampledField field = sampleOccupancyDistance(observed, options, {});
    std::vector<Eigen::Vector3d> marks;
    forEachSample(field, [&](int, int, int, std::size_t, const Eigen::Vector3d& p) {
      if (occupied(p)) marks.push_back(p);
    });
    ASSERT_GT(marks.size(), 100u);
    forEachSample(field, [&](int, int, int, std::size_t n, const Eigen::Vector3d& p) {
      double nearest = 1e9;
      for (const auto& q : marks) nearest = std::min(nearest, (p - q).norm());
      const double d = distance(p);
      const bool behind = options.sdf_method == "occupancy_edt_signed" && d < 0.0 && d >= -kTruncation;
      ASSERT_NEAR(field.values.data()[n], behind ? -nearest : nearest, 1e-5)
          << method << ' ' << p.transpose();
    });
  }
}

TEST(TruncatedDistance, IsTheFusedFieldAndGoesOnBehindTheBand) {
  const ObservedGrid observed = testing::observe([](const Eigen::Vector3d& p) { return p.x(); }, {30, 20, 20},
                                                 {-15, -10, -10}, kVoxel, kTruncation);
  const SampledField field = sampleTruncatedDistance(observed, defaults(), {});
  forEachSample(field, [&](int, int, int, std::size_t n, const Eigen::Vector3d& p) {
    const bool behind = p.x() < -kTruncation;
    EXPECT_NEAR(field.values.data()[n], behind ? -kTruncation : std::min(p.x(), kTruncation), 1e-6);
    EXPECT_EQ(field.known[n], behind ? 0 : 1);
  });
}

}  // namespace
}  // namespace ttsdf
