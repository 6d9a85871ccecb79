#include "ttsdf_localization/compression/tt_weighted.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

#include "ttsdf_localization/compression/tt_svd.h"

namespace ttsdf {
namespace {

/// Two spheres in a box: smooth, of no exact low rank.
DenseTensor twoSpheres(const Dims& dims) {
  DenseTensor tensor(dims);
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i) {
        const Eigen::Vector3d p(i, j, k);
        const double a = (p - Eigen::Vector3d(10, 8, 14)).norm() - 6.0;
        const double b = (p - Eigen::Vector3d(27, 13, 9)).norm() - 5.0;
        tensor(i, j, k) = static_cast<float>(std::min(a, b));
      }
    }
  }
  return tensor;
}

TensorTrain plain(const DenseTensor& tensor, int rank) {
  TtSvdOptions options;
  options.max_rank1 = options.max_rank2 = rank;
  return ttSvd(tensor, options).train;
}

TEST(FitWeighted, LowersTheWeightedErrorWhereTheWeightsAre) {
  const DenseTensor tensor = twoSpheres({36, 20, 28});
  std::vector<float> weights(tensor.size());
  for (std::size_t n = 0; n < weights.size(); ++n)
    weights[n] = std::abs(tensor.data()[n]) < 2.0f ? 1.0f : 0.01f;
  const TensorTrain start = plain(tensor, 6);
  WeightedFitOptions options;
  options.iterations = 40;
  const TensorTrain fitted = fitWeighted(tensor, weights, start, options);
  EXPECT_EQ(fitted.rank1(), 6);
  EXPECT_EQ(fitted.rank2(), 6);
  EXPECT_LT(weightedRms(tensor, weights, fitted), 0.7 * weightedRms(tensor, weights, start));
}

TEST(FitWeighted, EverySweepLowersTheWeightedError) {
  const DenseTensor tensor = twoSpheres({24, 18, 30});
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  std::vector<float> weights(tensor.size());
  for (auto& w : weights) w = uniform(random);
  double last = weightedRms(tensor, weights, plain(tensor, 5));
  for (int iterations = 1; iterations <= 8; ++iterations) {
    WeightedFitOptions options;
    options.iterations = iterations;
    const double rms = weightedRms(tensor, weights, fitWeighted(tensor, weights, plain(tensor, 5), options));
    EXPECT_LE(rms, last * (1.0 + 1e-4)) << iterations << " sweeps";
    last = rms;
  }
}

TEST(FitWeighted, DontCareSamplesHaveNoInfluence) {
  // Rank-1 data with a fifth of the samples spoilt: without them it is exactly rank 1 again.
  const Dims dims(15, 12, 14);
  DenseTensor clean(dims), spoilt(dims);
  std::vector<float> weights(clean.size(), 1.0f);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i) {
        clean(i, j, k) = (1.0f + 0.1f * static_cast<float>(i)) * (2.0f - 0.1f * static_cast<float>(j)) *
                         (0.5f + 0.05f * static_cast<float>(k));
        spoilt(i, j, k) = clean(i, j, k);
        if (uniform(random) < 0.2f) {
          spoilt(i, j, k) = 20.0f;
          weights[clean.offset(i, j, k)] = 0.0f;
        }
      }
    }
  }
  WeightedFitOptions options;
  options.iterations = 60;
  const TensorTrain fitted = fitWeighted(spoilt, weights, plain(spoilt, 1), options);
  const DenseTensor recovered = full(fitted);
  float worst = 0.0f;
  for (std::size_t n = 0; n < clean.size(); ++n)
    worst = std::max(worst, std::abs(recovered.data()[n] - clean.data()[n]));
  EXPECT_LT(worst, 1e-2f) << "values run from 0.4 to 6, spoilt ones are 20";
}

TEST(FitWeighted, ResultDoesNotDependOnTheThreads) {
  const DenseTensor tensor = twoSpheres({20, 16, 18});
  const std::vector<float> weights(tensor.size(), 0.5f);
  WeightedFitOptions one, three;
  one.iterations = three.iterations = 5;
  three.threads = 3;
  const TensorTrain a = fitWeighted(tensor, weights, plain(tensor, 5), one);
  const TensorTrain b = fitWeighted(tensor, weights, plain(tensor, 5), three);
  EXPECT_TRUE(a.middle() == b.middle());
}

TEST(FitWeighted, StopsWhenToldTo) {
  const DenseTensor tensor = twoSpheres({20, 16, 18});
  int sweeps = 0;
  WeightedFitOptions options;
  options.keep_going = [&](double) { return ++sweeps < 3; };
  fitWeighted(tensor, std::vector<float>(tensor.size(), 1.0f), plain(tensor, 4), options);
  EXPECT_EQ(sweeps, 3);
}

TEST(FitWeighted, RefusesShapesThatDiffer) {
  const DenseTensor tensor = twoSpheres({20, 16, 18});
  EXPECT_THROW(fitWeighted(tensor, std::vector<float>(7, 1.0f), plain(tensor, 4), {}), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
