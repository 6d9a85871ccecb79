// Fields sampled in tiles against the same fields sampled in dense arrays.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "../support/analytic_observation.h"
#include "ttsdf_localization/mapping/map_builder.h"
#include "ttsdf_localization/signed_field/field_bricks.h"
#include "ttsdf_localization/signed_field/ideal_volume.h"

namespace ttsdf {
namespace {

using testing::Distance;

constexpr double kVoxel = 0.02;

TsdfVolume observe(const Distance& distance, const Eigen::Array3i& begin, const Dims& size) {
  const auto sampler = [&](const Eigen::Array3i& first, const Dims& count, float* out) {
    for (int k = 0; k < count[2]; ++k) {
      for (int j = 0; j < count[1]; ++j) {
        for (int i = 0; i < count[0]; ++i, ++out) {
          const Eigen::Array3i index = first + Eigen::Array3i(i, j, k);
          *out = static_cast<float>(distance(kVoxel * index.cast<double>().matrix()));
        }
      }
    }
  };
  return idealVolume(sampler, begin, size, FusionOptions{});
}

/// 210 x 170 x 150 samples: eight tiles.
TsdfVolume observeRoom(const Eigen::Isometry3d& T_map_room = Eigen::Isometry3d::Identity()) {
  const Eigen::Isometry3d T_room_map = T_map_room.inverse();
  return observe([=](const Eigen::Vector3d& p) { return testing::roomDistance(T_room_map * p); },
                 {-112, -102, -86}, {224, 204, 172});
}

BuildOptions options(bool tiles) {
  BuildOptions o;
  o.align_axes = false;
  if (tiles) o.max_dense_voxels = 0;
  return o;
}

/// A field in bricks as dense arrays.
SampledField unpacked(const SampledField& field) {
  SampledField dense = field;
  dense.bricks = nullptr;
  dense.values = DenseTensor(field.geometry.dims);
  dense.known.resize(dense.values.size());
  for (int k = 0; k < field.geometry.dims[2]; ++k) {
    const std::size_t n = dense.values.offset(0, 0, k);
    field.bricks->readSlab({2, k, 0, 1, 0, dense.values.dims()[1]}, dense.values.data() + n,
                           dense.known.data() + n);
  }
  return dense;
}

template <class Function>
void forEachSample(const Dims& dims, const Function& fn) {
  std::size_t n = 0;
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i, ++n) fn(i, j, k, n);
    }
  }
}

TEST(SampledTiles, EqualTheDenseField) {
  const TsdfVolume volume = observeRoom();
  const SampledField dense = sampleField(volume, options(false)), tiled = sampleField(volume, options(true));
  ASSERT_EQ(dense.bricks, nullptr);
  ASSERT_NE(tiled.bricks, nullptr);
  ASSERT_TRUE((dense.geometry.dims == tiled.geometry.dims).all());
  EXPECT_TRUE(dense.geometry.T_map_grid.isApprox(tiled.geometry.T_map_grid));
  const SampledField bricks = unpacked(tiled);
  int other_values = 0, other_support = 0, supported = 0, behind = 0;
  forEachSample(dense.geometry.dims, [&](int i, int j, int k, std::size_t n) {
    ASSERT_EQ(dense.known[n], bricks.known[n]) << i << ' ' << j << ' ' << k;
    if (!dense.known[n]) return;
    const float value = dense.values.data()[n], difference = std::abs(value - bricks.values.data()[n]);
    // Single precision far from the origin, and 15 bits a value. Inside the ball all its facets are about as
    // far: the two searches may end on neighbouring ones, which is no more than the facets' distance from the
    // ball.
    if (value < 0.0F) {
      behind += difference > 2e-5F ? 1 : 0;
      EXPECT_LE(difference, 0.005 * kVoxel) << i << ' ' << j << ' ' << k;
    } else {
      other_values += difference > 2e-5F ? 1 : 0;
    }
    if (dense.values.data()[n] > 0.19F) return;
    supported += dense.mask.atVoxel(i, j, k) ? 1 : 0;
    other_support += dense.mask.atVoxel(i, j, k) != tiled.mask.atVoxel(i, j, k) ? 1 : 0;
  });
  EXPECT_EQ(other_values, 0);
  EXPECT_LE(behind, 40);
  EXPECT_LE(other_support, supported / 1000);
}

TEST(SampledTiles, DoNotDependOnTheThreads) {
  const TsdfVolume volume = observeRoom();
  BuildOptions one = options(true), two = options(true);
  one.threads = 1;
  two.threads = 2;
  const SampledField a = unpacked(sampleField(volume, one)), b = unpacked(sampleField(volume, two));
  EXPECT_TRUE(std::equal(a.values.data(), a.values.data() + a.values.size(), b.values.data()));
  EXPECT_EQ(a.known, b.known);
  EXPECT_EQ(a.mask.bits(), b.mask.bits());
}

TEST(SampledTiles, TurnTheirGridToTheRoom) {
  Eigen::Isometry3d T_map_room = Eigen::Isometry3d::Identity();
  T_map_room.linear() = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  BuildOptions o = options(true);
  o.align_axes = true;
  const SampledField field = unpacked(sampleField(observeRoom(T_map_room), o));
  const Eigen::Matrix3d R = field.geometry.T_map_grid.linear().transpose() * T_map_room.linear();
  EXPECT_LT(Eigen::AngleAxisd(R).angle(), 0.003);
  double squares = 0.0;
  int count = 0, wrong_signs = 0;
  forEachSample(field.geometry.dims, [&](int i, int j, int k, std::size_t n) {
    const Eigen::Vector3d p = field.geometry.samplePosition(Eigen::Vector3d(i, j, k));
    const double truth = testing::roomDistance(T_map_room.inverse() * p);
    if (!field.known[n] || std::abs(truth) > 1.5 * kVoxel) return;
    const double error = field.values.data()[n] - truth;
    squares += error * error;
    ++count;
    if (truth * field.values.data()[n] < 0.0 && std::abs(truth) > 0.1 * kVoxel) ++wrong_signs;
  });
  EXPECT_LE(std::sqrt(squares / count), 0.05 * kVoxel);
  EXPECT_EQ(wrong_signs, 0);
}

/// Two balls 8 m apart, and nothing observed between them but free space around each.
TEST(SampledTiles, TilesWithoutSurfaceAreFreeOrUnknown) {
  const Eigen::Vector3d far(8.0, 0.0, 0.0);
  const auto distance = [&](const Eigen::Vector3d& p) { return std::min(p.norm(), (p - far).norm()) - 0.3; };
  const TsdfVolume volume = observe(distance, {-40, -40, -40}, {481, 81, 81});
  const SampledField field = unpacked(sampleField(volume, options(true)));
  int free_samples = 0;
  forEachSample(field.geometry.dims, [&](int i, int j, int k, std::size_t n) {
    const Eigen::Vector3d p = field.geometry.samplePosition(Eigen::Vector3d(i, j, k));
    if (p.x() < 2.0 || p.x() > 6.0 || p.cwiseAbs().tail<2>().maxCoeff() > 0.4) return;
    ++free_samples;
    ASSERT_EQ(field.known[n], 1) << p.transpose();
    ASSERT_NEAR(field.values.data()[n], 0.2F, 1e-6F) << p.transpose();
  });
  EXPECT_GT(free_samples, 10000);
}

TEST(SampledTiles, CompressAsTheDenseFieldDoes) {
  const TsdfVolume volume = observeRoom();
  BuildOptions dense = options(false), tiles = options(true);
  dense.max_rank = tiles.max_rank = "20";
  dense.refine_iterations = tiles.refine_iterations = 5;
  const BuiltMap a = buildMap(volume, dense), b = buildMap(volume, tiles);
  EXPECT_EQ(a.report.dense_bytes, b.report.dense_bytes);
  EXPECT_NEAR(b.report.observed_share, a.report.observed_share, 1e-9);
  EXPECT_NEAR(b.report.surface_rms, a.report.surface_rms, 0.1 * a.report.surface_rms);
  EXPECT_NEAR(static_cast<double>(b.bytes.size()), static_cast<double>(a.bytes.size()),
              0.15 * static_cast<double>(a.bytes.size()));
}

TEST(SampledTiles, AreForClampedDistancesOnly) {
  const TsdfVolume volume = observeRoom();
  BuildOptions unclamped = options(true), tsdf = options(true);
  unclamped.clamp_positive = 0.0;
  tsdf.field = "tsdf";
  EXPECT_EQ(sampleField(volume, unclamped).bricks, nullptr);
  EXPECT_EQ(sampleField(volume, tsdf).bricks, nullptr);
}

TEST(SampledTiles, SayWhenNothingWasObservedAndCanBeCancelled) {
  EXPECT_THROW(sampleField(TsdfVolume(), options(true)), std::runtime_error);
  const auto plane = [](const Eigen::Vector3d& p) { return p.z(); };
  const TsdfVolume volume = observe(plane, {0, 0, -20}, {60, 60, 60});
  for (int stop = 0; stop < 3; ++stop) {
    int count = 0;
    EXPECT_THROW(
        sampleField(volume, options(true), [&](const std::string&, double) { return count++ < stop; }),
        std::runtime_error);
  }
}

}  // namespace
}  // namespace ttsdf
