#include "../../src/field/compressed/stored_cores.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "../../src/field/compressed/column_cache.h"

namespace ttsdf {
namespace {

TensorTrain randomTrain(int n1, int n2, int n3, int r1, int r2) {
  std::srand(7);
  return TensorTrain({{0, 1, 2}}, Eigen::MatrixXf::Random(n1, r1), Eigen::MatrixXf::Random(r1, n2 * r2),
                     Eigen::MatrixXf::Random(r2, n3));
}

TEST(StoredCores, DotProductsAreThoseOfWholeNumbers) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> number(-6000, 6000);
  for (const int width : {8, 16, 24, 40, 48, 64, 104}) {
    std::vector<std::int16_t> numbers(static_cast<std::size_t>(6 * width));
    for (std::int16_t& n : numbers) n = static_cast<std::int16_t>(number(random));
    const auto at = [&](int n) { return numbers.data() + n * width; };
    const std::int16_t* const columns[4] = {at(0), at(1), at(2), at(3)};
    const std::int16_t* const rows[2] = {at(4), at(5)};
    std::int32_t out[2][4];
    dotProducts(columns, rows, width, out);
    for (int r = 0; r < 2; ++r) {
      for (int q = 0; q < 4; ++q) {
        std::int64_t sum = 0;
        for (int b = 0; b < width; ++b) sum += std::int64_t{columns[q][b]} * rows[r][b];
        EXPECT_EQ(out[r][q], sum) << width;
      }
    }
  }
}

TEST(StoredCores, EightRowsTogetherAreThoseRowsOneByOne) {
  for (const int rank : {1, 8, 11, 40}) {
    const StoredCores cores(randomTrain(12, 5, 13, 6, rank));
    const int width = cores.width();
    std::vector<std::int32_t> storage(static_cast<std::size_t>(width / 2 * kRowsTogether));
    auto* const pairs = reinterpret_cast<std::int32_t(*)[kRowsTogether]>(storage.data());
    std::vector<float> scales(kColumnBlock);
    std::vector<std::int16_t> block(static_cast<std::size_t>(kColumnBlock * width));
    cores.contract(1, 3, scales.data(), block.data());
    const std::int16_t* const columns[4] = {&block[0], &block[static_cast<std::size_t>(width)],
                                            &block[static_cast<std::size_t>(2 * width)],
                                            &block[static_cast<std::size_t>(3 * width)]};
    for (const int k : {0, 3, 9, 12}) {  // from 6 on behind the last one
      float scale[kRowsTogether];
      std::int32_t out[4][kRowsTogether];
      cores.rowsTogether(k, pairs, scale);
      dotProducts(columns, pairs, width, out);
      for (int m = 0; m < kRowsTogether; ++m) {
        const int at = std::min(k + m, 12);
        EXPECT_EQ(scale[m], cores.lastScale(at));
        for (int q = 0; q < 4; ++q) {
          std::int64_t sum = 0;
          for (int b = 0; b < width; ++b) sum += std::int64_t{columns[q][b]} * cores.last(at)[b];
          EXPECT_EQ(out[q][m], sum) << rank << ", " << k << ", " << m;
        }
      }
    }
  }
}

TEST(StoredCores, LargeRanksDoNotOverflow) {
  // Constant cores of rank 300: every product of a sample has the same sign.
  const int rank = 300;
  const TensorTrain train({{0, 1, 2}}, Eigen::MatrixXf::Ones(310, 1), Eigen::MatrixXf::Ones(1, 2 * rank),
                          Eigen::MatrixXf::Ones(rank, 305));
  const StoredCores cores(train);
  ColumnCache columns(cores, 1 << 20);
  EXPECT_NEAR(columns.sample(5, 1, 7), 300.0f, 0.1f);
}

TEST(ColumnCache, SamplesAndBoxesAreThoseOfTheTrain) {
  const TensorTrain train = randomTrain(21, 18, 23, 9, 11);
  const StoredCores cores(train);
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{1} << 22}) {
    ColumnCache columns(cores, bytes);
    std::mt19937 random(5);
    for (int n = 0; n < 500; ++n) {
      const int i = static_cast<int>(random() % 21), j = static_cast<int>(random() % 18),
                k = static_cast<int>(random() % 23);
      EXPECT_NEAR(columns.sample(i, j, k), train(i, j, k), 2e-2f);
    }
    float samples[512];
    columns.box(15, 13, 20, 8, samples);
    for (int n = 0; n < 512; ++n) {
      EXPECT_NEAR(samples[n],
                  train(std::min(15 + n % 8, 20), std::min(13 + n / 8 % 8, 17), std::min(20 + n / 64, 22)),
                  2e-2f);
    }
  }
}

}  // namespace
}  // namespace ttsdf
