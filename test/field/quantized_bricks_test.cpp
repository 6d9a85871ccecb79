#include "../../src/field/quantized_bricks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace ttsdf {
namespace {

float planar(int i, int j, int k) {
  return 0.02f *
         (0.6f * static_cast<float>(i) - 0.64f * static_cast<float>(j) + 0.48f * static_cast<float>(k));
}

/// Every third brick of a grid, filled.
QuantizedBricks someBricks(const std::array<int, 3>& sizes) {
  QuantizedBricks bricks(sizes);
  for (QuantizedBricks::Id id = 0; id < bricks.idCount(); id += 3) bricks.reserve(id);
  bricks.allocate();
  float samples[kBrickSamples];
  for (int c = 0; c < bricks.counts()[2]; ++c) {
    for (int b = 0; b < bricks.counts()[1]; ++b) {
      for (int a = 0; a < bricks.counts()[0]; ++a) {
        if (!bricks.has(bricks.idOf(a, b, c))) continue;
        for (int n = 0; n < kBrickSamples; ++n) {
          samples[n] = planar(a * kBrickCells + n % kBrickSide, b * kBrickCells + n / kBrickSide % kBrickSide,
                              c * kBrickCells + n / kBrickSide / kBrickSide);
        }
        bricks.set(bricks.idOf(a, b, c), samples);
      }
    }
  }
  return bricks;
}

TEST(QuantizedBricks, GiveTheCornersOfCellsToHalfAStep) {
  const std::array<int, 3> sizes{{50, 40, 30}};
  const QuantizedBricks bricks = someBricks(sizes);
  std::mt19937 random(1);
  CellChunk cells;
  CornerChunk corners;
  std::int32_t missing[kChunk];
  cells.size = kChunk;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::uniform_int_distribution<std::int32_t> cell(0, sizes[axis] - 2);
    for (std::int32_t& n : cells.cell[axis]) n = cell(random);
  }
  const int misses = bricks.corners(cells, corners, missing);
  std::vector<bool> there(kChunk, true);
  for (int n = 0; n < misses; ++n) there[static_cast<std::size_t>(missing[n])] = false;
  const float step = 0.02f * 7.0f * (0.6f + 0.64f + 0.48f) / 255.0f;
  int found = 0;
  for (int n = 0; n < kChunk; ++n) {
    const int i = cells.cell[0][n], j = cells.cell[1][n], k = cells.cell[2][n];
    EXPECT_EQ(there[static_cast<std::size_t>(n)],
              bricks.has(bricks.idOf(i / kBrickCells, j / kBrickCells, k / kBrickCells)));
    if (!there[static_cast<std::size_t>(n)]) continue;
    ++found;
    for (int c = 0; c < 8; ++c) {
      EXPECT_NEAR(corners.value[n][c], planar(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)), 0.51f * step);
    }
  }
  EXPECT_GT(found, kChunk / 5);
  EXPECT_GT(misses, kChunk / 5);
}

TEST(QuantizedBricks, ThoseMadeWhenAskedForAreThoseOfTheWholeSet) {
  const std::array<int, 3> sizes{{50, 40, 30}};
  const QuantizedBricks whole = someBricks(sizes);
  QuantizedBricks few(sizes);
  for (QuantizedBricks::Id id = 0; id < few.idCount(); id += 3) few.reserve(id);
  EXPECT_EQ(few.reserved(), whole.size());
  constexpr std::size_t kHeld = 7;
  few.allocate(kHeld);
  EXPECT_FALSE(few.whole());
  EXPECT_TRUE(whole.whole());
  int made = 0;
  const auto decode = [&made](int a, int b, int c, float* samples) {
    ++made;
    for (int n = 0; n < kBrickSamples; ++n) {
      samples[n] = planar(a * kBrickCells + n % kBrickSide, b * kBrickCells + n / kBrickSide % kBrickSide,
                          c * kBrickCells + n / kBrickSide / kBrickSide);
    }
  };
  std::mt19937 random(2);
  CellChunk cells;
  CornerChunk expected, corners;
  std::int32_t missing[kChunk], missing_expected[kChunk];
  cells.size = kChunk;
  for (int round = 0; round < 20; ++round) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::uniform_int_distribution<std::int32_t> cell(0, sizes[axis] - 2);
      for (std::int32_t& n : cells.cell[axis]) n = cell(random);
    }
    const int misses = whole.corners(cells, expected, missing_expected);
    ASSERT_EQ(few.corners(cells, corners, missing, decode), misses);
    for (int n = 0; n < misses; ++n) EXPECT_EQ(missing[n], missing_expected[n]);
    for (int n = 0; n < kChunk; ++n) {
      for (int c = 0; c < 8; ++c) ASSERT_EQ(corners.value[n][c], expected.value[n][c]);
    }
  }
  EXPECT_GT(made, static_cast<int>(whole.size())) << "made again and again";

  // A few that fit are made once.
  cells.size = 3;
  for (int n = 0; n < 3; ++n) cells.cell[0][n] = 3 * kBrickCells * n, cells.cell[1][n] = cells.cell[2][n] = 0;
  few.corners(cells, corners, missing, decode);
  made = 0;
  for (int round = 0; round < 20; ++round) few.corners(cells, corners, missing, decode);
  EXPECT_EQ(made, 0);
}

TEST(QuantizedBricks, AsManyAreHeldAsBytesAllow) {
  const std::array<int, 3> sizes{{50, 40, 30}};
  const std::size_t empty = QuantizedBricks::bytesFor(sizes, 0);
  QuantizedBricks counted(sizes);
  for (QuantizedBricks::Id id = 0; id < counted.idCount(); ++id) counted.reserve(id);
  const std::size_t all = counted.reserved();
  for (const std::size_t bytes :
       {std::size_t{0}, std::size_t{5000}, std::size_t{50000}, std::size_t{1000000}}) {
    QuantizedBricks bricks = counted;
    const std::size_t held = QuantizedBricks::fitting(all, bytes);
    bricks.allocate(held);
    EXPECT_EQ(bricks.size(), std::min(held, all));
    if (held > 0) {
      EXPECT_LE(bricks.memoryBytes(), empty + bytes);
    }
    EXPECT_EQ(bricks.whole(), bytes == 1000000);
    EXPECT_EQ(held > 80, bytes >= 50000);
  }
}

TEST(QuantizedBricks, TakeTheBytesTheySay) {
  const std::array<int, 3> sizes{{50, 40, 30}};
  const QuantizedBricks bricks = someBricks(sizes);
  EXPECT_EQ(bricks.size(), (bricks.idCount() + 2) / 3);
  EXPECT_EQ(bricks.memoryBytes(), QuantizedBricks::bytesFor(sizes, bricks.size()));
}

TEST(QuantizedBricks, AnEmptySetMissesEveryPoint) {
  QuantizedBricks bricks(std::array<int, 3>{{9, 9, 9}});
  bricks.allocate();
  CellChunk cells;
  CornerChunk corners;
  std::int32_t missing[kChunk];
  cells.size = 5;
  for (auto& axis : cells.cell) std::fill(std::begin(axis), std::end(axis), 3);
  EXPECT_EQ(bricks.corners(cells, corners, missing), 5);
}

TEST(QuantizedBricks, ConstantSamplesStayWhatTheyAre) {
  QuantizedBricks bricks(std::array<int, 3>{{8, 8, 8}});
  bricks.reserve(0);
  bricks.allocate();
  const std::vector<float> samples(kBrickSamples, 0.2f);
  bricks.set(0, samples.data());
  CellChunk cells;
  CornerChunk corners;
  std::int32_t missing[kChunk];
  cells.size = 1;
  for (auto& axis : cells.cell) axis[0] = 6;
  EXPECT_EQ(bricks.corners(cells, corners, missing), 0);
  for (const float corner : corners.value[0]) EXPECT_EQ(corner, 0.2f);
}

}  // namespace
}  // namespace ttsdf
