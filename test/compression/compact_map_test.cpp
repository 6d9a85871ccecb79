// Sparse fits, and the maps made from them.

#include "ttsdf_localization/compression/compact_map.h"

#include <gtest/gtest.h>

#include <random>

#include "../map/room_map.h"
#include "ttsdf_localization/compression/sparse_fit.h"

namespace ttsdf {
namespace {

const Dims kDims(36, 24, 30);

constexpr int kKnown = 24;  // the map knows nothing from here on in x

/// The room where the map knows it, invented values elsewhere, as builders must fill in something.
DenseTensor halfKnownRoom() {
  DenseTensor tensor = test::roomTensor(kDims);
  std::mt19937 random(8);
  std::uniform_real_distribution<float> invented(-0.3f, 0.5f);
  for (std::size_t n = 0; n < tensor.size(); ++n) {
    if (static_cast<int>(n) % kDims[0] >= kKnown) tensor.data()[n] = invented(random);
  }
  return tensor;
}

std::vector<float> roomWeights(const DenseTensor& tensor) {
  std::vector<float> weights(tensor.size());
  for (std::size_t n = 0; n < tensor.size(); ++n) {
    const bool known = static_cast<int>(n) % kDims[0] < kKnown;
    weights[n] = known ? (std::abs(tensor.data()[n]) < 0.2f ? 1.0f : 0.2f) : 0.0f;
  }
  return weights;
}

double weightedError(const DenseTensor& tensor, const std::vector<float>& weights, const TensorTrain& train) {
  const DenseTensor approximation = full(train);
  double sum = 0.0, total = 0.0;
  for (std::size_t n = 0; n < tensor.size(); ++n) {
    const double d = static_cast<double>(tensor.data()[n]) - static_cast<double>(approximation.data()[n]);
    sum += static_cast<double>(weights[n]) * d * d;
    total += static_cast<double>(weights[n]);
  }
  return std::sqrt(sum / total);
}

TtSdfMap truncatedTo(int rank, const DenseTensor& tensor) {
  TtSdfMap map = test::roomMap(kDims, 3);
  TtSvdOptions options;
  options.max_rank1 = options.max_rank2 = rank;
  map.train = ttSvd(tensor, options).train;
  return map;
}

struct Fixture {
  DenseTensor tensor = halfKnownRoom();
  std::vector<float> weights = roomWeights(tensor);
  TtSdfMap map = truncatedTo(12, tensor);
};

SparseFitOptions fitOptions(double threshold, int iterations = 60) {
  SparseFitOptions options;
  options.threshold = threshold;
  options.iterations = iterations;
  return options;
}

/// 1/2 sum w (F - TT)^2 of a train in the bases of another, solved exactly: the least that any fit can reach.
double leastWeightedSquares(const Fixture& f, const TensorTrain& bases, int j) {
  const auto sizes = bases.modeSizes();
  const int r1 = bases.rank1(), r2 = bases.rank2();
  Eigen::MatrixXd design(sizes[0] * sizes[2], r1 * r2);
  Eigen::VectorXd target(design.rows());
  const ModeOrder& axes = bases.axes();
  for (int k = 0, row = 0; k < sizes[2]; ++k) {
    for (int i = 0; i < sizes[0]; ++i, ++row) {
      std::array<int, 3> at{};
      at[static_cast<std::size_t>(axes[0])] = i;
      at[static_cast<std::size_t>(axes[1])] = j;
      at[static_cast<std::size_t>(axes[2])] = k;
      const std::size_t n = f.tensor.offset(at[0], at[1], at[2]);
      const double w = std::sqrt(static_cast<double>(f.weights[n]));
      target[row] = w * static_cast<double>(f.tensor.data()[n]);
      for (int b = 0; b < r2; ++b) {
        for (int a = 0; a < r1; ++a) {
          design(row, a + r1 * b) =
              w * static_cast<double>(bases.first()(i, a)) * static_cast<double>(bases.last()(b, k));
        }
      }
    }
  }
  const Eigen::VectorXd solution = design.colPivHouseholderQr().solve(target);
  return 0.5 * (design * solution - target).squaredNorm();
}

TEST(SparseFit, WithoutThresholdItReachesTheWeightedLeastSquares) {
  Fixture f;
  f.map = truncatedTo(4, f.tensor);
  const TensorTrain fitted = fitSparse(f.tensor, f.weights, f.map.train, fitOptions(0.0, 1500));
  double least = 0.0, total = 0.0;
  for (int j = 0; j < fitted.modeSizes()[1]; ++j) least += leastWeightedSquares(f, fitted, j);
  for (const float w : f.weights) total += static_cast<double>(w);
  const double rms = weightedError(f.tensor, f.weights, fitted);
  EXPECT_NEAR(0.5 * rms * rms * total, least, 0.002 * least);
}

TEST(SparseFit, KeepsTheBasesOrthonormalAndTheirSpan) {
  const Fixture f;
  const TensorTrain fitted = fitSparse(f.tensor, f.weights, f.map.train, fitOptions(0.01));
  const Eigen::MatrixXf& U = fitted.first();
  EXPECT_TRUE((U.transpose() * U).isIdentity(1e-4f));
  EXPECT_TRUE((fitted.last() * fitted.last().transpose()).isIdentity(1e-4f));
  EXPECT_TRUE((U * (U.transpose() * f.map.train.first())).isApprox(f.map.train.first(), 1e-4f));
}

TEST(SparseFit, IsMoreExactThanTruncationWhereTheWeightsAre) {
  const Fixture f;
  const TensorTrain fitted = fitSparse(f.tensor, f.weights, f.map.train, fitOptions(1e-4));
  EXPECT_LT(weightedError(f.tensor, f.weights, fitted), weightedError(f.tensor, f.weights, f.map.train));
}

TEST(SparseFit, LargerThresholdsGiveSmallerFiles) {
  const Fixture f;
  std::size_t before = encodedSize(f.map, test::encodeAs(Encoding::kFloat16));
  for (const double threshold : {0.002, 0.006, 0.02}) {
    TtSdfMap map = f.map;
    map.train = fitSparse(f.tensor, f.weights, f.map.train, fitOptions(threshold));
    EncodeOptions options = test::encodeAs(Encoding::kQuantized);
    options.quantization_step = 0.01;
    const std::size_t size = encodedSize(map, options);
    EXPECT_LT(size, before);
    before = size;
  }
}

TEST(SparseFit, ThreadsDoNotChangeTheResult) {
  const Fixture f;
  SparseFitOptions options = fitOptions(0.01, 8);
  const TensorTrain one = fitSparse(f.tensor, f.weights, f.map.train, options);
  options.threads = 3;
  EXPECT_EQ(fitSparse(f.tensor, f.weights, f.map.train, options).middle(), one.middle());
}

TEST(SparseFit, CanBeEndedEarly) {
  const Fixture f;
  SparseFitOptions options = fitOptions(0.01, 50);
  std::vector<double> shares;
  options.keep_going = [&](double share) {
    shares.push_back(share);
    return shares.size() < 3;
  };
  fitSparse(f.tensor, f.weights, f.map.train, options);
  ASSERT_EQ(shares.size(), 3u);
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_LT(shares.back(), 1.0);
}

TEST(SparseFit, RefusesBadOptionsAndShapes) {
  const Fixture f;
  EXPECT_THROW(fitSparse(f.tensor, f.weights, f.map.train, fitOptions(-1.0)), std::invalid_argument);
  EXPECT_THROW(fitSparse(f.tensor, {}, f.map.train, fitOptions(0.01)), std::invalid_argument);
  EXPECT_THROW(fitSparse(DenseTensor(Dims(3, 3, 3)), std::vector<float>(27), f.map.train, fitOptions(0.01)),
               std::invalid_argument);
}

TEST(CompactMap, IsFarSmallerThanPlainQuantisationOfTheSameError) {
  const Fixture f;
  CompactOptions options;
  options.threshold = 0.01;
  const CompactMap compact = compactMap(f.map, f.tensor, f.weights, options);
  const double error = weightedError(f.tensor, f.weights, compact.map.train);
  // The coarsest plain quantisation that is as exact.
  std::size_t plain = encodedSize(f.map, test::encodeAs(Encoding::kFloat16));
  for (double rms = 1e-4; rms < 0.1; rms *= 1.3) {
    const auto bytes = serialize(f.map, test::encodeAs(Encoding::kQuantized, rms));
    if (weightedError(f.tensor, f.weights, deserialize(bytes.data(), bytes.size()).train) > error) break;
    plain = bytes.size();
  }
  EXPECT_LT(compact.bytes.size(), plain * 2 / 3);
}

TEST(CompactMap, TheTargetSizeIsKeptAndUsed) {
  const Fixture f;
  for (const std::size_t target : {2000u, 4000u, 8000u}) {
    CompactOptions options;
    options.target_bytes = target;
    const CompactMap compact = compactMap(f.map, f.tensor, f.weights, options);
    EXPECT_LE(compact.bytes.size(), target);
    EXPECT_GT(compact.bytes.size(), target * 9 / 10);
    EXPECT_EQ(serialize(compact.map), serialize(deserialize(compact.bytes.data(), compact.bytes.size())));
  }
}

TEST(CompactMap, TheTargetErrorIsKeptWithASmallerFileForALargerOne) {
  const Fixture f;
  std::size_t before = 1u << 30;
  // What the ranks can reach at all.
  const double least =
      weightedError(f.tensor, f.weights, fitSparse(f.tensor, f.weights, f.map.train, fitOptions(0.0, 500)));
  for (const double target : {1.3 * least, 1.7 * least, 2.5 * least}) {
    CompactOptions options;
    options.iterations = 60;  // a third of the room is missing: the fit converges slowly
    options.target_error = target;
    options.error = [&](const TensorTrain& train) { return weightedError(f.tensor, f.weights, train); };
    const CompactMap compact = compactMap(f.map, f.tensor, f.weights, options);
    EXPECT_LE(weightedError(f.tensor, f.weights, compact.map.train), target);
    EXPECT_LT(compact.bytes.size(), before);
    before = compact.bytes.size();
  }
}

TEST(CompactMap, TheSizeGoesBeforeTheError) {
  const Fixture f;
  CompactOptions options;
  options.target_error = 1e-3;
  options.target_bytes = 3000;
  options.error = [&](const TensorTrain& train) { return weightedError(f.tensor, f.weights, train); };
  EXPECT_LE(compactMap(f.map, f.tensor, f.weights, options).bytes.size(), 3000u);
}

TEST(CompactMap, KeepsWhatTheMapSays) {
  const Fixture f;
  const CompactMap compact = compactMap(f.map, f.tensor, f.weights, {});
  EXPECT_EQ(compact.map.metadata, f.map.metadata);
  EXPECT_EQ(compact.map.mask.bits(), f.map.mask.bits());
  EXPECT_EQ(compact.map.frame_id, f.map.frame_id);
}

TEST(CompactMap, CanBeCancelledAndRefusesBadOptions) {
  const Fixture f;
  const auto spoiled = [&](const auto& spoil) {
    CompactOptions options;
    spoil(options);
    return options;
  };
  EXPECT_THROW(compactMap(f.map, f.tensor, f.weights,
                          spoiled([](auto& o) { o.keep_going = [](double) { return false; }; })),
               std::runtime_error);
  EXPECT_THROW(compactMap(f.map, f.tensor, f.weights, spoiled([](auto& o) { o.threshold = 0.0; })),
               std::invalid_argument);
  EXPECT_THROW(compactMap(f.map, f.tensor, f.weights, spoiled([](auto& o) { o.target_error = 0.01; })),
               std::invalid_argument);
  EXPECT_THROW(compactMap(f.map, f.tensor, f.weights, spoiled([](auto& o) { o.target_bytes = 10; })),
               std::invalid_argument);
  EXPECT_THROW(compactMap(f.map, f.tensor, {}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
