#include "ttsdf_localization/field/tt_distance_field.h"

#include <gtest/gtest.h>

#include <thread>

#include "field_oracle.h"
#include "ttsdf_localization/compression/tt_svd.h"
#include "ttsdf_localization/field/dense_distance_field.h"

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

TtFieldOptions withCache(double megabytes) {
  TtFieldOptions options;
  options.cache_megabytes = megabytes;
  return options;
}

TEST(TtDistanceField, EqualsTheDecompressedFieldAtAnyRank) {
  // Interpolation in the compressed domain is exact: nothing but rounding lies between it and the full array.
  const Dims dims(40, 33, 36);
  const GridGeometry geometry = turnedGeometry(dims);
  const Eigen::Matrix3Xf points = randomPoints(geometry, 3000, 0.0, 0.01);
  for (const int rank : {1, 3, 15, 16, 17, 33}) {
    for (const auto interpolation : {Interpolation::kTrilinear, Interpolation::kNearest}) {
      const TensorTrain train = lowRank(dims, rank);
      TtFieldOptions options;
      options.interpolation = interpolation;
      const TtDistanceField compressed(train, geometry, {}, options);
      const DenseDistanceField dense(full(train), geometry, {}, interpolation);
      const FieldSamples a = compressed.evaluate(points), b = dense.evaluate(points);
      EXPECT_LT((a.values - b.values).cwiseAbs().maxCoeff(), 2e-6f);
      EXPECT_LT((a.gradients - b.gradients).cwiseAbs().maxCoeff(), 4e-4f)
          << "2e-6 over voxels of 2 cm, twice";
      EXPECT_EQ(a.states, b.states);
    }
  }
}

TEST(TtDistanceField, PortableKernelsAgreeWithTheWidestOnesWithinRounding) {
  const Dims dims(40, 33, 36);
  const GridGeometry geometry = turnedGeometry(dims);
  const TensorTrain train = lowRank(dims, 20);
  TtFieldOptions options;
  options.portable = true;
  const TtDistanceField portable(train, geometry, {}, options), widest(train, geometry);
  const Eigen::Matrix3Xf points = randomPoints(geometry, 3000);
  const FieldSamples a = portable.evaluate(points), b = widest.evaluate(points);
  EXPECT_LT((a.values - b.values).cwiseAbs().maxCoeff(), 2e-6f);
  EXPECT_LT((a.gradients - b.gradients).cwiseAbs().maxCoeff(), 4e-4f);
  EXPECT_EQ(a.states, b.states);
}

TEST(TtDistanceField, KeepsTheCacheBoundWithoutChangingAnswers) {
  const Dims dims(80, 60, 70);
  const GridGeometry geometry = turnedGeometry(dims);
  const TensorTrain train = lowRank(dims, 20);
  const TtDistanceField roomy(train, geometry);
  // Always there: a brick of 8^3 samples, a block of 8 columns padded to 32, their numbers, and for each of
  // 12 x 9 x 10 bricks and 12 x 60 blocks of columns where it is.
  constexpr std::size_t kLeast = 4 * (8 * 8 * 8 + 8 * 32 + 2 + 12 * 9 * 10 + 12 * 60);
  for (const double megabytes : {0.0, 0.01, 0.1, 0.5, 2.0}) {
    for (const auto interpolation : {Interpolation::kTrilinear, Interpolation::kNearest}) {
      TtFieldOptions options = withCache(megabytes);
      options.interpolation = interpolation;
      const TtDistanceField bounded(train, geometry, {}, options);
      options.cache_megabytes = 100.0;
      const TtDistanceField reference(train, geometry, {}, options);
      for (unsigned seed = 1; seed <= 4; ++seed) {
        const Eigen::Matrix3Xf points = randomPoints(geometry, 1500, 0.0, 0.0, seed);
        expectSame(bounded.evaluate(points), reference.evaluate(points));
        EXPECT_LE(bounded.cacheBytes(), static_cast<std::size_t>(1e6 * megabytes) + kLeast);
      }
      EXPECT_LT(bounded.memoryBytes(), 3 * train.memoryBytes() + bounded.cacheBytes());
    }
  }
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

TEST(TtDistanceField, WarmUpMakesTheSurfaceReadyAndChangesNoAnswer) {
  const Dims dims(40, 33, 36);
  GridGeometry geometry = turnedGeometry(dims);
  geometry.voxel_size = 1.0 / dims.maxCoeff();  // the tensor's distances are in units of the longest side
  const TensorTrain train = lowRank(dims, 25);
  TtDistanceField warm(train, geometry);
  const TtDistanceField cold(train, geometry);
  warm.warmUp();
  const std::size_t bytes = warm.cacheBytes();
  // Points on the zero level, found on edges between samples of different sign.
  const DenseTensor tensor = full(train);
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
  ASSERT_GT(surface.size(), 300u);
  const Eigen::Map<const Eigen::Matrix3Xf> points(surface.front().data(), 3,
                                                  static_cast<Eigen::Index>(surface.size()));
  expectSame(warm.evaluate(points), cold.evaluate(points));
  EXPECT_EQ(warm.cacheBytes(), bytes) << "the first scan found everything made";
  EXPECT_GT(cold.cacheBytes(), 0u);
}

TEST(TtDistanceField, WarmUpReplacesWhatAPassThroughTheWholeMapLeft) {
  const Dims dims(40, 33, 36);
  GridGeometry geometry = turnedGeometry(dims);
  geometry.voxel_size = 1.0 / dims.maxCoeff();
  const TensorTrain train = lowRank(dims, 25);
  const TtFieldOptions few = withCache(0.2);  // 150 bricks of 2 kB would be more
  TtDistanceField passed(train, geometry, {}, few);
  const TtDistanceField untouched(train, geometry, {}, few);
  Eigen::Matrix3Xf lattice(3, dims.prod());
  for (int n = 0; n < lattice.cols(); ++n) {
    const Eigen::Vector3d index(n % dims[0], n / dims[0] % dims[1], n / dims[0] / dims[1]);
    lattice.col(n) = geometry.samplePosition(index).cast<float>();
  }
  passed.evaluate(lattice);
  EXPECT_GT(passed.cacheBytes(), 150000u);
  passed.warmUp(), untouched.warmUp();
  EXPECT_EQ(passed.cacheBytes(), untouched.cacheBytes());
  expectSame(passed.evaluate(lattice), untouched.evaluate(lattice));
}

TEST(TtDistanceField, WarmUpKeepsTheBound) {
  const Dims dims(40, 33, 36);
  TtDistanceField field(lowRank(dims, 12), turnedGeometry(dims, 10.0), {},
                        withCache(0.05));  // all of it is "near"
  field.warmUp();
  EXPECT_LE(field.cacheBytes(), 50000u);
  EXPECT_GT(field.cacheBytes(), 25000u);
}

TEST(TtDistanceField, SeveralThreadsGetTheAnswersOfOne) {
  const Dims dims(40, 33, 36);
  const GridGeometry geometry = turnedGeometry(dims);
  const TensorTrain train = lowRank(dims, 12);
  for (const double megabytes : {0.02, 16.0}) {  // all the time dropping bricks; hardly ever
    for (const auto interpolation : {Interpolation::kTrilinear, Interpolation::kNearest}) {
      TtFieldOptions options = withCache(megabytes);
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
          shared.cacheBytes();
        });
      }
      for (auto& thread : threads) thread.join();
      for (std::size_t n = 0; n < points.size(); ++n) expectSame(answers[n], truth[n]);
    }
  }
}

TEST(TtDistanceField, RefusesACacheThatIsNone) {
  const Dims dims(10, 9, 8);
  for (const double megabytes : {-1.0, std::nan(""), 1e9}) {
    EXPECT_THROW(TtDistanceField(lowRank(dims, 3), turnedGeometry(dims), {}, withCache(megabytes)),
                 std::invalid_argument);
  }
}

TEST(TtDistanceField, RefusesAnEmptyTrain) {
  EXPECT_THROW(TtDistanceField(TensorTrain(), turnedGeometry(Dims(10, 9, 8))), std::invalid_argument);
  EXPECT_THROW(TtDistanceField(TensorTrain(), GridGeometry()), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
