// What both fields promise, the uncompressed and the compressed one (at full rank, in every mode order).

#include "ttsdf_localization/field/distance_field.h"

#include <gtest/gtest.h>

#include <limits>
#include <memory>

#include "field_oracle.h"
#include "ttsdf_localization/compression/tt_svd.h"
#include "ttsdf_localization/field/dense_distance_field.h"
#include "ttsdf_localization/field/tt_distance_field.h"

namespace ttsdf {
namespace {

using test::randomPoints;
using test::turnedGeometry;

struct Kind {
  const char* name;
  bool compressed;
  ModeOrder axes;
};

std::unique_ptr<DistanceField> makeField(const Kind& kind, const DenseTensor& tensor,
                                         const GridGeometry& geometry, SupportMask mask = {},
                                         Interpolation interpolation = Interpolation::kTrilinear) {
  if (!kind.compressed) {
    return std::make_unique<DenseDistanceField>(tensor, geometry, std::move(mask), interpolation);
  }
  TtSvdOptions svd;
  svd.axes = kind.axes;
  TtFieldOptions options;
  options.interpolation = interpolation;
  return std::make_unique<TtDistanceField>(ttSvd(tensor, svd).train, geometry, std::move(mask), options);
}

class DistanceFieldTest : public testing::TestWithParam<Kind> {
 protected:
  const Dims dims_{14, 11, 9};
  const GridGeometry geometry_ = turnedGeometry(dims_);
  const DenseTensor tensor_ = test::distanceTensor(dims_);  // values up to 1, slopes up to 1 / 14 per voxel
  // A point in float at 3 m, in voxels of 2 cm: 1e-5 voxels; times the slope. Compressed fields keep 13 bits
  // of a column and of a row: half a step of each, of values up to 1.
  const double value_tolerance_ = GetParam().compressed ? 1.0 / 8192.0 : 5e-6;
  const double gradient_tolerance_ =
      4.0 * value_tolerance_ / 0.02;  // weights of a difference at a border: 4 in all
};

TEST_P(DistanceFieldTest, TrilinearEqualsBruteForce) {
  const auto field = makeField(GetParam(), tensor_, geometry_);
  const Eigen::Matrix3Xf points = randomPoints(geometry_, 2000, 0.0, 0.01);
  const FieldSamples samples = field->evaluate(points);
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    const auto truth = test::trilinear(tensor_, geometry_, points.col(n).cast<double>());
    ASSERT_EQ(samples.states[static_cast<std::size_t>(n)], PointState::kValid);
    ASSERT_NEAR(samples.values[n], truth.value, value_tolerance_);
    ASSERT_LT((samples.gradients.col(n).cast<double>() - truth.gradient).norm(), gradient_tolerance_);
  }
}

TEST_P(DistanceFieldTest, GradientIsTheDerivativeOfTheValueInsideACell) {
  const auto field = makeField(GetParam(), tensor_, geometry_);
  const Eigen::Matrix3Xf points = randomPoints(geometry_, 500, 0.0, 0.15);
  const FieldSamples samples = field->evaluate(points);
  const float step =
      static_cast<float>(0.1 * geometry_.voxel_size);  // stays inside the cell in any direction
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Matrix3Xf ahead = points, behind = points;
    ahead.row(axis).array() += step;
    behind.row(axis).array() -= step;
    const Eigen::VectorXf numeric =
        (field->evaluate(ahead).values - field->evaluate(behind).values) / (2.0f * step);
    // Central differences of a trilinear function are exact up to the product of three slopes.
    EXPECT_LT((numeric - samples.gradients.row(axis).transpose()).cwiseAbs().maxCoeff(), 5e-3f);
  }
}

TEST_P(DistanceFieldTest, NearestIsThePapersRoundingWithFiniteDifferences) {
  const auto field = makeField(GetParam(), tensor_, geometry_, {}, Interpolation::kNearest);
  const Eigen::Matrix3Xf points = randomPoints(geometry_, 2000, 0.5, 0.01);
  const FieldSamples samples = field->evaluate(points);
  const TensorTrain train = ttSvd(tensor_, {}).train;
  std::array<DenseTensor, 3> slopes;
  for (int axis = 0; axis < 3; ++axis) {
    slopes[static_cast<std::size_t>(axis)] = full(differentiate(train, axis, geometry_.voxel_size));
  }
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    const Eigen::Array3i v = test::nearestVoxel(geometry_, points.col(n).cast<double>());
    const Eigen::Vector3d slope(slopes[0](v[0], v[1], v[2]), slopes[1](v[0], v[1], v[2]),
                                slopes[2](v[0], v[1], v[2]));
    ASSERT_EQ(samples.states[static_cast<std::size_t>(n)], PointState::kValid);
    ASSERT_NEAR(samples.values[n], tensor_(v[0], v[1], v[2]), value_tolerance_);
    ASSERT_LT((samples.gradients.col(n).cast<double>() - geometry_.T_map_grid.linear() * slope).norm(),
              gradient_tolerance_);
  }
}

TEST_P(DistanceFieldTest, ASampleIsMetAtItsIndexAndTheMeanHalfWay) {
  // The half-voxel convention: no shift between samples and their positions.
  const auto field = makeField(GetParam(), tensor_, geometry_);
  Eigen::Matrix3Xf points(3, 2);
  points.col(0) = geometry_.samplePosition(Eigen::Vector3d(5.0, 4.0, 3.0)).cast<float>();
  points.col(1) = geometry_.samplePosition(Eigen::Vector3d(5.5, 4.0, 3.0)).cast<float>();
  const FieldSamples samples = field->evaluate(points);
  EXPECT_NEAR(samples.values[0], tensor_(5, 4, 3), value_tolerance_);
  EXPECT_NEAR(samples.values[1], 0.5 * (tensor_(5, 4, 3) + tensor_(6, 4, 3)), value_tolerance_);
}

TEST_P(DistanceFieldTest, BordersBelongToTheBox) {
  GridGeometry geometry;  // voxels of 2 cm are no binary fractions: positions of the last samples are rounded
  geometry.dims = dims_;
  geometry.voxel_size = 0.02;
  for (const auto interpolation : {Interpolation::kTrilinear, Interpolation::kNearest}) {
    const auto field = makeField(GetParam(), tensor_, geometry, {}, interpolation);
    for (int corner = 0; corner < 8; ++corner) {
      const Dims voxel(corner & 1 ? dims_[0] - 1 : 0, corner & 2 ? dims_[1] - 1 : 0,
                       corner & 4 ? dims_[2] - 1 : 0);
      Eigen::Matrix3Xf points(3, 4);
      const Eigen::Vector3d index = voxel.cast<double>();
      points.col(0) = geometry.samplePosition(index).cast<float>();
      for (int axis = 0; axis < 3; ++axis) {
        Eigen::Vector3d beyond = index;
        beyond[axis] += voxel[axis] == 0 ? -0.1 : 0.1;
        points.col(axis + 1) = geometry.samplePosition(beyond).cast<float>();
      }
      const FieldSamples samples = field->evaluate(points);
      EXPECT_EQ(samples.states[0], PointState::kValid) << corner;
      EXPECT_NEAR(samples.values[0], tensor_(voxel[0], voxel[1], voxel[2]), value_tolerance_);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(samples.states[axis + 1], PointState::kOutside) << corner;
        EXPECT_EQ(samples.values[static_cast<Eigen::Index>(axis) + 1], 0.0f);
        EXPECT_TRUE(samples.gradients.col(static_cast<Eigen::Index>(axis) + 1).isZero());
      }
    }
  }
}

TEST_P(DistanceFieldTest, EveryFaceOfATurnedBoxIsInside) {
  const auto field = makeField(GetParam(), tensor_, geometry_);
  Eigen::Matrix3Xf points = randomPoints(geometry_, 600);
  for (int n = 0; n < 600; ++n) {
    Eigen::Vector3d index = geometry_.toIndex(points.col(n).cast<double>());
    const int axis = n % 3;
    index[axis] = n % 2 == 0 ? 0.0 : dims_[axis] - 1.0;
    points.col(n) = geometry_.samplePosition(index).cast<float>();
  }
  for (const PointState state : field->evaluate(points).states) EXPECT_EQ(state, PointState::kValid);
}

TEST_P(DistanceFieldTest, PointsThatAreNoneAreOutside) {
  const auto field = makeField(GetParam(), tensor_, geometry_);
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity(),
              huge = std::numeric_limits<float>::max();
  const Eigen::Vector3f inside = geometry_.samplePosition(Eigen::Vector3d(5.0, 5.0, 5.0)).cast<float>();
  Eigen::Matrix3Xf points(3, 15);
  int n = 0;
  for (const float bad : {nan, inf, -inf, huge, -1e20f}) {
    for (int axis = 0; axis < 3; ++axis, ++n) {
      points.col(n) = inside;
      points(axis, n) = bad;
    }
  }
  const FieldSamples samples = field->evaluate(points);
  for (const PointState state : samples.states) EXPECT_EQ(state, PointState::kOutside);
  EXPECT_TRUE(samples.values.isZero(0.0f));
  EXPECT_TRUE(samples.gradients.isZero(0.0f));
}

TEST_P(DistanceFieldTest, UnknownIsWhatTheMaskDoesNotSupport) {
  constexpr int kCell = 4;
  for (const auto interpolation : {Interpolation::kTrilinear, Interpolation::kNearest}) {
    SupportMask mask(dims_, kCell, true);
    mask.set(1, 0, 2, false);
    mask.set(3, 2, 0, false);
    const auto masked = makeField(GetParam(), tensor_, geometry_, mask, interpolation);
    const auto plain = makeField(GetParam(), tensor_, geometry_, {}, interpolation);
    const Eigen::Matrix3Xf points = randomPoints(geometry_, 3000, 0.5, 0.01);
    const FieldSamples samples = masked->evaluate(points), reference = plain->evaluate(points);
    int unknown = 0;
    for (Eigen::Index n = 0; n < points.cols(); ++n) {
      const Eigen::Array3i v = test::nearestVoxel(geometry_, points.col(n).cast<double>());
      const bool supported = mask.at(v[0] / kCell, v[1] / kCell, v[2] / kCell);
      ASSERT_EQ(samples.states[static_cast<std::size_t>(n)],
                supported ? PointState::kValid : PointState::kUnknown);
      unknown += supported ? 0 : 1;
    }
    EXPECT_GT(unknown, 50);
    EXPECT_EQ(samples.values, reference.values) << "unknown points keep the field's value";
    EXPECT_EQ(samples.gradients, reference.gradients);
  }
}

TEST_P(DistanceFieldTest, OutsideBeatsUnknown) {
  const auto field = makeField(GetParam(), tensor_, geometry_, SupportMask(dims_, 3, false));
  Eigen::Matrix3Xf points(3, 2);
  points.col(0) = geometry_.samplePosition(Eigen::Vector3d(5.0, 5.0, 5.0)).cast<float>();
  points.col(1) = geometry_.samplePosition(Eigen::Vector3d(-5.0, 5.0, 5.0)).cast<float>();
  const FieldSamples samples = field->evaluate(points);
  EXPECT_EQ(samples.states[0], PointState::kUnknown);
  EXPECT_EQ(samples.states[1], PointState::kOutside);
}

TEST_P(DistanceFieldTest, BatchesOfAnySizeGiveTheSameAnswers) {
  const auto field = makeField(GetParam(), tensor_, geometry_);
  const Eigen::Matrix3Xf points = randomPoints(geometry_, 600);
  const FieldSamples all = field->evaluate(points);
  for (const int size : {0, 1, 15, 16, 17, 255, 256, 257, 513}) {
    const FieldSamples part = field->evaluate(points.leftCols(size).eval());
    ASSERT_EQ(part.values.size(), size);
    if (size == 0) continue;
    // To rounding: the last points of a batch may be computed one by one, with or without fused operations.
    EXPECT_LT((part.values - all.values.head(size)).cwiseAbs().maxCoeff(), 1e-6f) << size;
    EXPECT_LT((part.gradients - all.gradients.leftCols(size)).cwiseAbs().maxCoeff(), 1e-5f) << size;
  }
}

TEST_P(DistanceFieldTest, ModesOfLengthOneAndTwoWork) {
  for (const Dims& dims :
       {Dims(1, 6, 5), Dims(6, 1, 5), Dims(6, 5, 1), Dims(1, 1, 1), Dims(2, 2, 2), Dims(2, 1, 7)}) {
    const DenseTensor tensor = test::noiseTensor(dims);
    GridGeometry geometry;  // not turned: the plane of a single sample is met exactly
    geometry.dims = dims;
    geometry.voxel_size = 0.25;
    double largest = 1.0;  // steps are shares of it
    for (std::size_t n = 0; n < geometry.voxelCount(); ++n) {
      largest = std::max(largest, static_cast<double>(std::abs(tensor.data()[n])));
    }
    for (const auto interpolation : {Interpolation::kTrilinear, Interpolation::kNearest}) {
      const auto field = makeField(GetParam(), tensor, geometry, {}, interpolation);
      const Eigen::Matrix3Xf points =
          randomPoints(geometry, 100, interpolation == Interpolation::kNearest ? 0.5 : 0.0, 0.01);
      const FieldSamples samples = field->evaluate(points);
      for (Eigen::Index n = 0; n < points.cols(); ++n) {
        const Eigen::Vector3d p = points.col(n).cast<double>();
        const Eigen::Array3i v = test::nearestVoxel(geometry, p);
        const double truth = interpolation == Interpolation::kNearest
                                 ? tensor(v[0], v[1], v[2])
                                 : test::trilinear(tensor, geometry, p).value;
        ASSERT_EQ(samples.states[static_cast<std::size_t>(n)], PointState::kValid);
        ASSERT_NEAR(samples.values[n], truth, largest * value_tolerance_) << dims.transpose();
        for (int axis = 0; axis < 3; ++axis) {
          if (dims[axis] == 1) {
            ASSERT_EQ(samples.gradients(axis, n), 0.0f);
          }
        }
      }
    }
  }
}

TEST_P(DistanceFieldTest, RefusesPartsThatDisagree) {
  EXPECT_THROW(makeField(GetParam(), tensor_, turnedGeometry(Dims(14, 11, 8))), std::invalid_argument);
  EXPECT_THROW(makeField(GetParam(), tensor_, turnedGeometry(dims_, 0.0)), std::invalid_argument);
  EXPECT_THROW(makeField(GetParam(), tensor_, geometry_, SupportMask(Dims(14, 11, 13), 4, true)),
               std::invalid_argument);
  EXPECT_NO_THROW(makeField(GetParam(), tensor_, geometry_, SupportMask(dims_, 4, true)));
}

TEST_P(DistanceFieldTest, ReportsItsMemory) {
  EXPECT_GT(makeField(GetParam(), tensor_, geometry_)->memoryBytes(), 1000u);
}

INSTANTIATE_TEST_SUITE_P(AllFields, DistanceFieldTest,
                         testing::Values(Kind{"dense", false, {}}, Kind{"tt012", true, {{0, 1, 2}}},
                                         Kind{"tt021", true, {{0, 2, 1}}}, Kind{"tt102", true, {{1, 0, 2}}},
                                         Kind{"tt120", true, {{1, 2, 0}}}, Kind{"tt201", true, {{2, 0, 1}}},
                                         Kind{"tt210", true, {{2, 1, 0}}}),
                         [](const auto& kind) { return std::string(kind.param.name); });

TEST(DenseDistanceField, WhatIsNotFiniteInTheArrayStaysInside) {
  const Dims dims(5, 5, 5);
  DenseTensor tensor = test::distanceTensor(dims);
  tensor(0, 0, 0) = std::numeric_limits<float>::quiet_NaN();
  GridGeometry geometry;
  geometry.dims = dims;
  geometry.voxel_size = 1.0;
  const DenseDistanceField field(tensor, geometry);
  const FieldSamples samples = field.evaluate(Eigen::Matrix3Xf(Eigen::Vector3f(-9.0f, -9.0f, -9.0f)));
  EXPECT_EQ(samples.states[0], PointState::kOutside);
  EXPECT_EQ(samples.values[0], 0.0f);
  EXPECT_TRUE(samples.gradients.isZero(0.0f));
}

TEST(Interpolation, HasNamesForOptionsAndFiles) {
  for (const auto interpolation : {Interpolation::kNearest, Interpolation::kTrilinear}) {
    EXPECT_EQ(interpolationFromName(name(interpolation)), interpolation);
  }
  EXPECT_THROW(interpolationFromName("cubic"), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
