#include "../../src/field/brick_decoder.h"

#include <gtest/gtest.h>

#include "../tensor/test_tensors.h"

namespace ttsdf {
namespace {

TEST(BrickDecoder, YieldsTheSamplesOfTheTrain) {
  for (const auto& n : {std::array<int, 3>{{8, 7, 10}}, {{4, 4, 4}}, {{5, 3, 1}}, {{1, 1, 6}}, {{2, 9, 3}}}) {
    const TensorTrain tt = test::randomTrain({{0, 1, 2}}, n, 5, 17);
    const double tolerance = 1e-5 * norm(tt);
    // Room for all columns, and for one block of them only.
    for (const std::size_t bytes : {std::size_t{1000000}, std::size_t{0}}) {
      BrickDecoder decoder(tt, columnKernels(), bytes);
      for (int c = 0; c < decoder.bricks()[2]; ++c) {
        for (int b = 0; b < decoder.bricks()[1]; ++b) {
          for (int a = 0; a < decoder.bricks()[0]; ++a) {
            float samples[kBrickSamples];
            decoder.decode(a, b, c, samples);
            for (int s = 0; s < kBrickSamples; ++s) {
              const int i = std::min(a * kBrickCells + s % kBrickSide, n[0] - 1),
                        j = std::min(b * kBrickCells + s / kBrickSide % kBrickSide, n[1] - 1),
                        k = std::min(c * kBrickCells + s / (kBrickSide * kBrickSide), n[2] - 1);
              EXPECT_NEAR(samples[s], tt(i, j, k), tolerance);
            }
          }
        }
      }
    }
  }
}

TEST(BrickDecoder, BricksCoverEveryCell) {
  for (const int n : {1, 2, 3, 4, 5, 6, 7, 8, 100}) {
    const BrickDecoder decoder(test::randomTrain({{0, 1, 2}}, {{n, n, n}}, 1, 1), columnKernels(), 0);
    EXPECT_GE(decoder.bricks()[0] * kBrickCells, n - 1);
    EXPECT_LT((decoder.bricks()[0] - 1) * kBrickCells, std::max(1, n - 1));
  }
}

}  // namespace
}  // namespace ttsdf
