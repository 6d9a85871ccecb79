#include "../../src/field/compressed/quantized_bricks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
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

void planarBrick(int a, int b, int c, float* samples) {
  for (int n = 0; n < kBrickSamples; ++n) {
    samples[n] = planar(a * kBrickCells + n % kBrickSide, b * kBrickCells + n / kBrickSide % kBrickSide,
                        c * kBrickCells + n / kBrickSide / kBrickSide);
  }
}

TEST(QuantizedBricks, AppendedOneByOneTheyAreThoseSet) {
  const std::array<int, 3> sizes{{50, 40, 30}};
  const QuantizedBricks set = someBricks(sizes);
  QuantizedBricks appended(sizes);
  float samples[kBrickSamples];
  for (int b = 0; b < set.counts()[1]; ++b) {
    for (int a = 0; a < set.counts()[0]; ++a) {
      for (int c = 0; c < set.counts()[2]; ++c) {
        if (!set.has(set.idOf(a, b, c))) continue;
        planarBrick(a, b, c, samples);
        appended.append(appended.idOf(a, b, c), samples);
      }
    }
  }
  QuantizedBricks dropped = appended;
  appended.finish();
  EXPECT_TRUE(appended.whole());
  EXPECT_EQ(appended.memoryBytes(), set.memoryBytes());
  CellChunk cells;
  CornerChunk expected, corners;
  std::int32_t missing[kChunk];
  cells.size = kChunk;
  std::mt19937 random(3);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::uniform_int_distribution<std::int32_t> cell(0, sizes[axis] - 2);
    for (std::int32_t& n : cells.cell[axis]) n = cell(random);
  }
  EXPECT_EQ(appended.corners(cells, corners, missing), set.corners(cells, expected, missing));
  for (int n = 0; n < kChunk; ++n) {
    for (int c = 0; c < 8; ++c) ASSERT_EQ(corners.value[n][c], expected.value[n][c]);
  }
  dropped.dropAppended();
  dropped.allocate(7);
  EXPECT_EQ(dropped.reserved(), set.size()) << "which ones there are is kept";
  EXPECT_EQ(dropped.size(), 7u);
}

TEST(QuantizedBricks, ThoseMadeInAdvanceAreNotMadeAgain) {
  const std::array<int, 3> sizes{{50, 40, 30}};
  QuantizedBricks bricks(sizes);
  for (QuantizedBricks::Id id = 0; id < bricks.idCount(); ++id) bricks.reserve(id);
  bricks.allocate(40);
  std::vector<QuantizedBricks::Id> made;
  const auto decode = [&](int a, int b, int c, float* samples) {
    made.push_back(bricks.idOf(a, b, c));
    planarBrick(a, b, c, samples);
  };
  CellChunk cells;
  cells.size = 30;  // places in no order, some of them twice
  for (int n = 0; n < cells.size; ++n) {
    cells.cell[0][n] = kBrickCells * (n * 11 % 5), cells.cell[1][n] = kBrickCells * (n % 2);
    cells.cell[2][n] = kBrickCells * (n * 7 % 3);
  }
  std::vector<QuantizedBricks::Id> ids;
  bricks.findUnmade(cells, ids);
  bricks.make(ids, decode);
  EXPECT_EQ(made.size(), 30u);
  EXPECT_TRUE(std::is_sorted(made.begin(), made.end()));
  CornerChunk corners;
  std::int32_t missing[kChunk];
  ids.clear();
  bricks.findUnmade(cells, ids);
  EXPECT_TRUE(ids.empty());
  EXPECT_EQ(bricks.corners(cells, corners, missing, decode), 0);
  EXPECT_EQ(made.size(), 30u);
  const float step = 0.02f * 7.0f * (0.6f + 0.64f + 0.48f) / 255.0f;
  for (int n = 0; n < cells.size; ++n)
    EXPECT_NEAR(corners.value[n][0], planar(cells.cell[0][n], cells.cell[1][n], cells.cell[2][n]),
                0.51f * step);

  // More than there is room for: as many as there is room for, and the others when they are asked for.
  ids.clear();
  for (QuantizedBricks::Id id = 0; id < bricks.idCount(); ++id) ids.push_back(id);
  made.clear();
  bricks.make(ids, decode);
  EXPECT_EQ(made.size(), 40u);
  EXPECT_EQ(bricks.corners(cells, corners, missing, decode), 0);
  for (int n = 0; n < cells.size; ++n)
    EXPECT_NEAR(corners.value[n][0], planar(cells.cell[0][n], cells.cell[1][n], cells.cell[2][n]),
                0.51f * step);
}

TEST(QuantizedBricks, NumbersThatAreNoneCountAsZero) {
  QuantizedBricks bricks(std::array<int, 3>{{8, 8, 8}});
  std::vector<float> samples(kBrickSamples, 1.0f);
  samples[0] = std::nanf("");
  samples[1] = std::numeric_limits<float>::infinity();
  samples[8] = -std::numeric_limits<float>::infinity();
  bricks.append(0, samples.data());
  bricks.finish();
  CellChunk cells;
  CornerChunk corners;
  std::int32_t missing[kChunk];
  cells.size = 1;
  for (auto& axis : cells.cell) axis[0] = 0;
  EXPECT_EQ(bricks.corners(cells, corners, missing), 0);
  const float expected[8] = {0.0f, 0.0f, 0.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f};
  for (int c = 0; c < 8; ++c) EXPECT_FLOAT_EQ(corners.value[0][c], expected[c]);
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

TEST(QuantizedBricks, DroppedOnesTakeNoMemory) {
  const std::array<int, 3> sizes{{50, 40, 30}};
  QuantizedBricks appended(sizes);
  const std::size_t empty = appended.memoryBytes();
  float samples[kBrickSamples];
  for (int c = 0; c < appended.counts()[2]; ++c) {
    planarBrick(0, 0, c, samples);
    appended.append(appended.idOf(0, 0, c), samples);
  }
  EXPECT_GE(appended.memoryBytes(), empty + static_cast<std::size_t>(appended.counts()[2]) * kBrickSamples);
  appended.dropAppended();
  EXPECT_EQ(appended.memoryBytes(), empty);
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
