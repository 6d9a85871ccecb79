#include <gtest/gtest.h>

#include <random>

#include "room_map.h"

namespace ttsdf {
namespace {

using test::rmsDifference;
using test::rmsValue;
using test::roomMap;

TtSdfMap quantized(const TtSdfMap& map, const EncodeOptions& options) {
  const auto bytes = serialize(map, options);
  return deserialize(bytes.data(), bytes.size());
}

EncodeOptions withRms(double rms) { return test::encodeAs(Encoding::kQuantized, rms); }

EncodeOptions withBytes(std::size_t bytes) {
  EncodeOptions options = withRms(0.0);
  options.target_bytes = bytes;
  return options;
}

/// A train without any structure: nothing for transforms and predictions to hold on to.
TtSdfMap noiseMap(const Dims& dims, int rank) {
  std::mt19937 random(3);
  std::normal_distribution<float> normal(0.0f, 0.1f);
  DenseTensor noise(dims);
  for (std::size_t n = 0; n < noise.size(); ++n) noise.data()[n] = normal(random);
  TtSdfMap map = roomMap(dims, 3);
  TtSvdOptions options;
  options.max_rank1 = options.max_rank2 = rank;
  map.train = ttSvd(noise, options).train;
  return map;
}

TEST(QuantizedCores, TheErrorBudgetHoldsOverTheFullArray) {
  for (const TtSdfMap& map : {roomMap(), roomMap(Dims(12, 40, 30), 20), noiseMap(Dims(14, 11, 13), 9)}) {
    for (const double rms : {0.05, 0.01, 1e-3, 1e-4, 1e-5}) {
      EXPECT_LE(rmsDifference(quantized(map, withRms(rms)).train, map.train), 1.001 * rms) << rms;
    }
  }
}

TEST(QuantizedCores, TheErrorBudgetIsUsed) {
  const TtSdfMap map = roomMap(Dims(40, 30, 35), 20);
  for (const double rms : {1e-2, 1e-3, 1e-4}) {
    EXPECT_GT(rmsDifference(quantized(map, withRms(rms)).train, map.train), 0.8 * rms);
  }
}

TEST(QuantizedCores, CoarserIsSmaller) {
  const TtSdfMap map = roomMap(Dims(40, 30, 35), 20);
  std::size_t before = encodedSize(map, test::encodeAs(Encoding::kFloat16));
  for (const double rms : {1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2}) {
    const std::size_t size = encodedSize(map, withRms(rms));
    EXPECT_LT(size, before) << rms;
    before = size;
  }
}

TEST(QuantizedCores, DefaultBudgetIsATenthOfAVoxel) {
  const TtSdfMap map = roomMap();
  EXPECT_EQ(serialize(map, withRms(0.0)), serialize(map, withRms(0.1 * map.geometry.voxel_size)));
}

TEST(QuantizedCores, AnyFormOfTheSameTrainGivesTheSameField) {
  const TtSdfMap map = roomMap();
  // The same field with its first core mixed up and badly scaled, and with components that carry nothing.
  std::mt19937 random(4);
  std::normal_distribution<float> normal;
  const int r1 = map.train.rank1();
  Eigen::MatrixXf mix(r1, r1);
  for (Eigen::Index n = 0; n < mix.size(); ++n) mix.data()[n] = normal(random);
  mix.diagonal().array() += 5.0f;
  Eigen::MatrixXf middle = mix.inverse() * map.train.middle() * 1e4f;
  TtSdfMap mixed = map;
  mixed.train = TensorTrain(map.train.axes(), map.train.first() * mix * 1e-4f, middle, map.train.last());
  mixed.train = add(mixed.train, scale(mixed.train, 0.0f));
  const TtSdfMap read = quantized(mixed, withRms(1e-3));
  EXPECT_LE(rmsDifference(read.train, map.train), 1.01e-3);
  EXPECT_LE(read.train.rank1(), r1);
}

TEST(QuantizedCores, ComponentsBelowTheStepAreDropped) {
  const TtSdfMap map = roomMap(Dims(40, 30, 35), 20);
  const TtSdfMap read = quantized(map, withRms(0.05));
  EXPECT_LT(read.train.rank1(), map.train.rank1());
  EXPECT_LT(read.train.parameterCount(), map.train.parameterCount());
}

TEST(QuantizedCores, ScaleOfTheFieldDoesNotMatter) {
  const TtSdfMap map = roomMap();
  const auto size = static_cast<double>(encodedSize(map, withRms(1e-3)));
  for (const float factor : {1e-3f, 1e3f}) {
    TtSdfMap scaled = map;
    scaled.train = scale(map.train, factor);
    const double rms = 1e-3 * static_cast<double>(factor);
    EXPECT_LE(rmsDifference(quantized(scaled, withRms(rms)).train, scaled.train), 1.001 * rms);
    EXPECT_NEAR(static_cast<double>(encodedSize(scaled, withRms(rms))), size, 0.1 * size);
  }
}

TEST(QuantizedCores, RanksAtTheModeSizesWork) {
  const TtSdfMap map = noiseMap(Dims(6, 5, 7), 0);
  EXPECT_EQ(map.train.rank1(), 6);
  EXPECT_EQ(map.train.rank2(), 7);
  EXPECT_LE(rmsDifference(quantized(map, withRms(1e-3)).train, map.train), 1.001e-3);
}

TEST(QuantizedCores, AllZeroStaysAllZero) {
  TtSdfMap map = roomMap();
  map.train = scale(map.train, 0.0f);
  EXPECT_EQ(rmsValue(quantized(map, withRms(1e-3)).train), 0.0);
}

TEST(QuantizedCores, TheTargetSizeIsKeptAndUsed) {
  const TtSdfMap map = roomMap(Dims(40, 30, 35), 20);
  double error_before = 1.0;
  for (const std::size_t target : {3000u, 6000u, 12000u, 20000u}) {
    const auto bytes = serialize(map, withBytes(target));
    EXPECT_LE(bytes.size(), target);
    EXPECT_GT(bytes.size(), target * 95 / 100);
    const double error = rmsDifference(deserialize(bytes.data(), bytes.size()).train, map.train);
    EXPECT_LT(error, error_before);
    error_before = error;
  }
}

TEST(QuantizedCores, TargetSizesOutOfReach) {
  TtSdfMap map = roomMap();
  EXPECT_THROW(serialize(map, withBytes(100)), std::invalid_argument);
  EXPECT_LT(serialize(map, withBytes(1000000)).size(), 1000000u);
  map.train = scale(map.train, 0.0f);
  EXPECT_LT(serialize(map, withBytes(2000)).size(), 2000u);
}

TEST(QuantizedCores, RefusesBudgetsThatAreNone) {
  EXPECT_THROW(serialize(roomMap(), withRms(-1.0)), std::invalid_argument);
  EXPECT_THROW(serialize(roomMap(), withRms(std::nan(""))), std::invalid_argument);
  EncodeOptions options = withRms(0.0);
  options.quantization_step = -1.0;
  EXPECT_THROW(serialize(roomMap(), options), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
