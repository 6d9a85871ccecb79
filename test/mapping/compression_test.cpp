#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "ttsdf_localization/mapping/map_builder.h"
#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {
namespace {

/// A box and a ball in a room, 5 cm voxels; the upper quarter unknown.
SampledField room() {
  SampledField field;
  field.geometry.dims = {48, 26, 40};
  field.geometry.voxel_size = 0.05;
  field.values = DenseTensor(field.geometry.dims);
  field.known.assign(field.values.size(), 1);
  field.mask = SupportMask(field.geometry.dims, 4, true);
  const auto box = [](const Eigen::Vector3d& p, const Eigen::Vector3d& c, const Eigen::Vector3d& h) {
    const Eigen::Array3d d = (p - c).array().abs() - h.array();
    return d.max(0.0).matrix().norm() + std::min(d.maxCoeff(), 0.0);
  };
  for (int k = 0; k < 40; ++k) {
    for (int j = 0; j < 26; ++j) {
      for (int i = 0; i < 48; ++i) {
        const Eigen::Vector3d p = field.geometry.samplePosition({double(i), double(j), double(k)});
        const double walls = -box(p, {1.2, 0.6, 1.0}, {1.1, 0.55, 0.9});
        const double inside = std::min(box(p, {0.7, 0.3, 0.6}, {0.3, 0.25, 0.2}),
                                       (p - Eigen::Vector3d(1.7, 0.4, 1.3)).norm() - 0.3);
        field.values(i, j, k) = static_cast<float>(std::max(-0.15, std::min(0.3, std::min(walls, inside))));
        if (j >= 20) field.known[field.values.offset(i, j, k)] = 0;
      }
    }
  }
  return field;
}

BuildOptions options() {
  BuildOptions o;
  o.clamp_negative = 0.15;
  o.clamp_positive = 0.3;
  o.max_rank = "12";
  return o;
}

TEST(Compress, ReportsTheErrorOfTheMapThatAReaderSees) {
  const SampledField field = room();
  const BuiltMap built = compress(field, FusionOptions{}, options());
  const DenseTensor decoded = full(deserialize(built.bytes.data(), built.bytes.size()).train);
  double squares = 0.0, near = 0.0;
  for (std::size_t n = 0; n < decoded.size(); ++n) {
    if (!field.known[n] || std::abs(field.values.data()[n]) > 0.03f) continue;
    const double d = decoded.data()[n] - field.values.data()[n];
    squares += d * d;
    near += 1.0;
  }
  EXPECT_NEAR(built.report.surface_rms, std::sqrt(squares / near), 1e-6);
  EXPECT_EQ(built.report.file_bytes, built.bytes.size());
  EXPECT_EQ(built.report.rank1, 12);
}

TEST(Compress, WeightedFitIsNearerToTheSurfaceThanPlainTtSvd) {
  const SampledField field = room();
  BuildOptions plain = options(), fitted = options();
  plain.encoding = fitted.encoding = "float32";
  plain.refine_iterations = 0;
  fitted.refine_iterations = 30;
  EXPECT_LT(compress(field, {}, fitted).report.surface_rms,
            0.8 * compress(field, {}, plain).report.surface_rms);
}

TEST(Compress, KeepsToATargetSize) {
  BuildOptions o = options();
  o.target_bytes = 12000;
  const BuiltMap built = compress(room(), {}, o);
  EXPECT_LE(built.bytes.size(), 12000u);
  EXPECT_GT(built.bytes.size(), 6000u) << "a budget is there to be used";
}

TEST(Compress, KeepsToATargetError) {
  BuildOptions o = options();
  o.target_surface_error = 0.01;
  const BuiltMap built = compress(room(), {}, o);
  EXPECT_LE(built.report.surface_rms, 0.01);
  ASSERT_GT(built.report.rank1, 1);
  BuildOptions smaller = options();
  smaller.max_rank = std::to_string(built.report.rank1 - 1);
  EXPECT_GT(compress(room(), {}, smaller).report.surface_rms, 0.01) << "a rank less would do";
}

TEST(Compress, SaysWhatABudgetCannotReach) {
  BuildOptions bytes = options(), error = options(), both = options();
  bytes.target_bytes = 100;
  error.target_surface_error = 1e-9;
  both.target_bytes = 10000;
  both.target_surface_error = 0.01;
  EXPECT_THROW(compress(room(), {}, bytes), std::runtime_error);
  EXPECT_THROW(compress(room(), {}, error), std::runtime_error);
  EXPECT_THROW(compress(room(), {}, both), std::invalid_argument);
}

TEST(Compress, RefusesRanksThatAreNone) {
  for (const char* text : {"", "x", "4,", "4;5", "4,5,6", "-1", "4 5", " ", "-", "99999999999"}) {
    BuildOptions o = options();
    o.max_rank = text;
    EXPECT_THROW(compress(room(), {}, o), std::invalid_argument) << "'" << text << "'";
  }
}

TEST(Compress, TakesTwoRanks) {
  BuildOptions o = options();
  o.max_rank = "8,5";
  const BuiltMap built = compress(room(), {}, o);
  EXPECT_LE(built.report.rank1, 8);
  EXPECT_LE(built.report.rank2, 5);
}

TEST(Compress, CanBeCancelled) {
  EXPECT_THROW(compress(room(), {}, options(), [](const std::string&, double) { return false; }),
               std::runtime_error);
}

}  // namespace
}  // namespace ttsdf
