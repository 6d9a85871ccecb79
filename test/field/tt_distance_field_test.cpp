#include "ttsdf_localization/field/tt_distance_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "field_oracle.h"
#include "ttsdf_localization/compression/tt_svd.h"
#include "ttsdf_localization/field/dense_distance_field.h"
#include "ttsdf_localization/field/long_range_field.h"

namespace ttsdf {
namespace {

using test::randomPoints;
using test::turnedGeometry;

void expectSame(const FieldSamples& a, const FieldSamples& b) {
  EXPECT_EQ(a.values, b.values);
  EXPECT_EQ(a.gradients, b.gradients);
  EXPECT_EQ(a.states, b.states);
}

TensorTrain lowRank(const Dims& dims, int rank) {
  TtSvdOptions options;
  options.max_rank1 = options.max_rank2 = rank;
  return ttSvd(test::distanceTensor(dims), options).train;
}

TtFieldOptions withMemory(double megabytes) {
  TtFieldOptions options;
  options.memory_megabytes = megabytes;
  return options;
}

/// Error of the stored numbers: 13 bits of a column, summed up over the rank.
constexpr float kStored = 1e-3f;
/// A byte spans the 7 voxels of a brick along its diagonal at most: half a step of a 255th.
constexpr float kByteVoxels = 0.5f * 1.7321f * 7.0f / 255.0f;

TEST(TtDistanceField, EqualsTheDecompressedFieldAtAnyRank) {
  const Dims dims(40, 33, 36);
  const GridGeometry geometry = turnedGeometry(dims);
  const Eigen::Matrix3Xf points = randomPoints(geometry, 3000, 0.0, 0.01);
  for (const int rank : {1, 3, 7, 8, 9, 15, 16, 17, 33}) {
    for (const auto interpolation : {Interpolation::kTrilinear, Interpolation::kNearest}) {
      const TensorTrain train = lowRank(dims, rank);
      TtFieldOptions options;
      options.interpolation = interpolation;
      const TtDistanceField compressed(train, geometry, {}, options);
      const DenseDistanceField dense(full(train), geometry, {}, interpolation);
      const FieldSamples a = compressed.evaluate(points), b = dense.evaluate(points);
      EXPECT_LT((a.values - b.values).cwiseAbs().maxCoeff(), kStored * b.values.cwiseAbs().maxCoeff());
      EXPECT_LT((a.gradients - b.gradients).cwiseAbs().maxCoeff(),
                2.0f * kStored * b.values.cwiseAbs().maxCoeff() / static_cast<float>(geometry.voxel_size));
      EXPECT_EQ(a.states, b.states);
    }
  }
}

TEST(TtDistanceField, TheScaleOfComponentsDoesNotMatter) {
  // Any diagonal may be moved from one core to the next; the stored numbers must not suffer.
  const Dims dims(40, 33, 36);
  const GridGeometry geometry = turnedGeometry(dims);
  const TensorTrain train = lowRank(dims, 12);
  Eigen::MatrixXf first = train.first(), middle = train.middle(), last = train.last();
  for (int r = 0; r < 12; ++r) {
    const float up = std::pow(10.0f, static_cast<float>(r % 5) - 2.0f);
    first.col(r) *= up, middle.row(r) /= up;
    last.row(r) /= up;
    for (int j = 0; j < train.modeSizes()[1]; ++j) middle.col(j * 12 + r) *= up;
  }
  const TtDistanceField field(TensorTrain(train.axes(), first, middle, last), geometry);
  const DenseDistanceField dense(full(train), geometry);
  const Eigen::Matrix3Xf points = randomPoints(geometry, 2000);
  const FieldSamples a = field.evaluate(points), b = dense.evaluate(points);
  EXPECT_LT((a.values - b.values).cwiseAbs().maxCoeff(), kStored * b.values.cwiseAbs().maxCoeff());
}

TEST(TtDistanceField, KeepsTheBoundWithoutChangingAnswers) {
  const Dims dims(80, 60, 70);
  const GridGeometry geometry = turnedGeometry(dims);
  const TensorTrain train = lowRank(dims, 20);
  TtDistanceField least(train, geometry, {}, withMemory(0.0));
  least.warmUp();
  const std::size_t always = least.memoryBytes();
  const TtDistanceField reference(train, geometry, {}, withMemory(100.0));
  for (const double megabytes : {0.0, 0.05, 0.4, 0.7, 1.0, 2.0}) {
    const TtDistanceField bounded(train, geometry, {}, withMemory(megabytes));
    for (unsigned seed = 1; seed <= 4; ++seed) {
      const Eigen::Matrix3Xf points = randomPoints(geometry, 1500, 0.0, 0.0, seed);
      expectSame(bounded.evaluate(points), reference.evaluate(points));
    }
    bounded.warmUp();
    const auto bound = static_cast<std::size_t>(1e6 * megabytes);
    EXPECT_LE(bounded.memoryBytes() + LongRangeField::bytesFor(geometry),
              std::max(bound, always + LongRangeField::bytesFor(geometry)));
  }
}

TEST(TtDistanceField, OnceWarmAnswersDoNotDependOnTheMemory) {
  const Dims dims(170, 170, 160);
  GridGeometry geometry = turnedGeometry(dims);
  geometry.voxel_size = 1.0 / dims.maxCoeff();
  const TensorTrain train = lowRank(dims, 6);
  const TtDistanceField least(train, geometry, {}, withMemory(0.0));
  const TtDistanceField reference(train, geometry, {}, withMemory(100.0));
  least.warmUp();
  reference.warmUp();
  ASSERT_GT(reference.memory().bricks, least.memory().bricks + 100000u);
  std::vector<Eigen::Matrix3Xf> points;
  std::vector<FieldSamples> truth;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    points.push_back(randomPoints(geometry, 4000, 0.0, 0.0, seed));
    truth.push_back(reference.evaluate(points.back()));
    expectSame(least.evaluate(points.back()), truth.back());
  }
  std::vector<FieldSamples> answers(points.size());
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (std::size_t n = t; n < points.size(); n += 4) answers[n] = least.evaluate(points[n]);
    });
  }
  for (auto& thread : threads) thread.join();
  for (std::size_t n = 0; n < points.size(); ++n) expectSame(answers[n], truth[n]);
}

TEST(TtDistanceField, PreparingForPointsChangesNoAnswerAndTakesNoMemory) {
  const Dims dims(170, 170, 160);
  GridGeometry geometry = turnedGeometry(dims);
  geometry.voxel_size = 1.0 / dims.maxCoeff();
  const TensorTrain train = lowRank(dims, 6);
  const TtDistanceField prepared(train, geometry, {}, withMemory(0.0)),
      reference(train, geometry, {}, withMemory(0.0)), whole(train, geometry, {}, withMemory(100.0)),
      cold(train, geometry, {}, withMemory(0.0));
  for (const TtDistanceField* field : {&prepared, &reference, &whole}) field->warmUp();
  const std::size_t bytes = prepared.memoryBytes();
  for (unsigned seed = 1; seed <= 5; ++seed) {
    // More bricks than there is room for, points outside among them.
    const Eigen::Matrix3Xf points = randomPoints(geometry, 4000, 0.0, 0.2, seed);
    const Eigen::VectorXf x = points.row(0), y = points.row(1), z = points.row(2);
    const PointSpan span{x.data(), y.data(), z.data(), static_cast<int>(points.cols())};
    for (const TtDistanceField* field : {&prepared, &whole, &cold}) field->prepare(span);
    const FieldSamples truth = reference.evaluate(points);
    expectSame(prepared.evaluate(points), truth);
    expectSame(whole.evaluate(points), truth);
  }
  EXPECT_EQ(prepared.memoryBytes(), bytes);
  EXPECT_EQ(cold.memory().bricks, 0u) << "without bricks there is nothing to make";
}

TEST(TtDistanceField, AnswersDoNotDependOnWhatWasAskedBefore) {
  const Dims dims(40, 33, 36);
  const GridGeometry geometry = turnedGeometry(dims);
  const TensorTrain train = lowRank(dims, 12);
  const TtDistanceField fresh(train, geometry), used(train, geometry);
  for (unsigned seed = 1; seed <= 5; ++seed) used.evaluate(randomPoints(geometry, 500, 0.0, 0.0, seed));
  const Eigen::Matrix3Xf points = randomPoints(geometry, 2000, 0.0, 0.0, 9);
  expectSame(used.evaluate(points), fresh.evaluate(points));
}

/// Points on the zero level, on edges between samples of different sign.
Eigen::Matrix3Xf surfaceOf(const DenseTensor& tensor, const GridGeometry& geometry) {
  const Dims& dims = geometry.dims;
  std::vector<Eigen::Vector3f> surface;
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i + 1 < dims[0]; ++i) {
        const double a = tensor(i, j, k), b = tensor(i + 1, j, k);
        if ((a < 0.0) == (b < 0.0)) continue;
        surface.push_back(geometry.samplePosition(Eigen::Vector3d(i + a / (a - b), j, k)).cast<float>());
      }
    }
  }
  return Eigen::Map<const Eigen::Matrix3Xf>(surface.front().data(), 3,
                                            static_cast<Eigen::Index>(surface.size()));
}

TEST(TtDistanceField, WarmUpKeepsTheSurfaceInBytes) {
  const Dims dims(80, 66, 72);
  GridGeometry geometry = turnedGeometry(dims);
  geometry.voxel_size = 1.0 / dims.maxCoeff();  // the tensor's distances are in units of the longest side
  const TensorTrain train = lowRank(dims, 25);
  const DenseTensor tensor = full(train);
  const DenseDistanceField dense(tensor, geometry);
  const TtDistanceField field(train, geometry, {}, withMemory(100.0));
  const Eigen::Matrix3Xf points = surfaceOf(tensor, geometry);
  ASSERT_GT(points.cols(), 300);
  const std::size_t columns = field.memory().columns;
  EXPECT_EQ(field.memory().bricks, 0u);
  field.warmUp();
  EXPECT_LT(field.memory().columns, columns) << "columns make room";
  // 7^3 cells a brick: all of them would be 12 x 10 x 11.
  EXPECT_GT(field.memory().bricks, 200u * 520u);
  EXPECT_LT(field.memory().bricks, 1000u * 520u);
  const FieldSamples a = field.evaluate(points), b = dense.evaluate(points);
  const auto voxel = static_cast<float>(geometry.voxel_size);
  EXPECT_LT((a.values - b.values).cwiseAbs().maxCoeff(), 1.5f * kByteVoxels * voxel);
  EXPECT_LT((a.gradients - b.gradients).cwiseAbs().maxCoeff(), 4.0f * kByteVoxels);
  // Rounding errors are even within half a step (1 / sqrt(3) of it as rms); a difference of two, along three
  // axes.
  EXPECT_LT((a.gradients - b.gradients).norm(), kByteVoxels * std::sqrt(2.0f) * b.gradients.norm());
  EXPECT_EQ(a.states, b.states);
}

TEST(TtDistanceField, WarmUpCanBeCancelledAndDoneAgain) {
  const Dims dims(40, 33, 36);
  GridGeometry geometry = turnedGeometry(dims);
  geometry.voxel_size = 1.0 / dims.maxCoeff();
  const TtDistanceField field(lowRank(dims, 12), geometry);
  int asked = 0;
  EXPECT_THROW(field.warmUp([&] { return ++asked < 3; }), Cancelled);
  EXPECT_EQ(asked, 3);
  EXPECT_EQ(field.memory().bricks, 0u);
  field.warmUp();
  EXPECT_GT(field.memory().bricks, 0u);
}

TEST(TtDistanceField, SeveralThreadsGetTheAnswersOfOne) {
  const Dims dims(40, 33, 36);
  const GridGeometry geometry = turnedGeometry(dims);
  const TensorTrain train = lowRank(dims, 12);
  for (const double megabytes : {0.0, 16.0}) {  // all the time dropping columns; hardly ever
    for (const auto interpolation : {Interpolation::kTrilinear, Interpolation::kNearest}) {
      TtFieldOptions options = withMemory(megabytes);
      options.interpolation = interpolation;
      const TtDistanceField reference(train, geometry, {}, options), shared(train, geometry, {}, options);
      constexpr unsigned kThreads = 4, kRounds = 8;
      std::vector<Eigen::Matrix3Xf> points;
      std::vector<FieldSamples> truth;
      for (unsigned n = 0; n < kThreads * kRounds; ++n) {
        points.push_back(randomPoints(geometry, 400, 0.0, 0.0, n));
        truth.push_back(reference.evaluate(points.back()));
      }
      std::vector<FieldSamples> answers(points.size());
      std::vector<std::thread> threads;
      for (unsigned t = 0; t < kThreads; ++t) {
        threads.emplace_back([&, t] {
          for (unsigned n = t; n < points.size(); n += kThreads) answers[n] = shared.evaluate(points[n]);
          shared.memoryBytes();
        });
      }
      for (auto& thread : threads) thread.join();
      for (std::size_t n = 0; n < points.size(); ++n) expectSame(answers[n], truth[n]);
    }
  }
}

TEST(TtDistanceField, RefusesAMemoryThatIsNone) {
  const Dims dims(10, 9, 8);
  for (const double megabytes : {-1.0, std::nan(""), 1e9}) {
    EXPECT_THROW(TtDistanceField(lowRank(dims, 3), turnedGeometry(dims), {}, withMemory(megabytes)),
                 std::invalid_argument);
  }
}

TEST(TtDistanceField, RefusesAnEmptyTrain) {
  EXPECT_THROW(TtDistanceField(TensorTrain(), turnedGeometry(Dims(10, 9, 8))), std::invalid_argument);
  EXPECT_THROW(TtDistanceField(TensorTrain(), GridGeometry()), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
