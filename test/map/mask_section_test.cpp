// The support mask in the file.

#include <gtest/gtest.h>

#include <random>

#include "room_map.h"

namespace ttsdf {
namespace {

std::size_t maskBytes(const TtSdfMap& map) {
  TtSdfMap without = map;
  without.mask = {};
  return serialize(map).size() - serialize(without).size();
}

void expectSurvives(const TtSdfMap& map) {
  const auto bytes = serialize(map);
  const SupportMask read = deserialize(bytes.data(), bytes.size()).mask;
  EXPECT_EQ(read.bits(), map.mask.bits());
  EXPECT_EQ(read.cellVoxels(), map.mask.cellVoxels());
  EXPECT_TRUE((read.cellDims() == map.mask.cellDims()).all());
}

TEST(MaskSection, EveryCellSizeSurvives) {
  for (const int cell : {1, 2, 3, 4, 7, 30}) {
    TtSdfMap map = test::roomMap();
    map.mask = test::roomMask(map.geometry.dims, cell);
    expectSurvives(map);
  }
}

TEST(MaskSection, FullEmptyAndRandomMasksSurvive) {
  TtSdfMap map = test::roomMap();
  std::mt19937 random(7);
  for (const double share : {0.0, 0.02, 0.5, 0.98, 1.0}) {
    map.mask = SupportMask(map.geometry.dims, 2, false);
    const Dims& cells = map.mask.cellDims();
    for (int c = 0; c < cells[2]; ++c) {
      for (int b = 0; b < cells[1]; ++b) {
        for (int a = 0; a < cells[0]; ++a)
          map.mask.set(a, b, c, static_cast<double>(random()) < share * 4294967296.0);
      }
    }
    expectSurvives(map);
  }
}

TEST(MaskSection, FlatGridsSurvive) {
  for (const Dims& dims : {Dims(1, 1, 1), Dims(1, 20, 9), Dims(20, 1, 9), Dims(20, 9, 1)}) {
    TtSdfMap map = test::roomMap(dims, 1);
    map.mask = test::roomMask(dims, 1);
    expectSurvives(map);
  }
}

TEST(MaskSection, ARoomsMaskTakesLessThanAQuarterOfItsBits) {
  // Shell of 2 cells around a box and a ball, as supports of surfaces look like.
  TtSdfMap map = test::roomMap(Dims(60, 60, 60), 3);
  map.mask = SupportMask(map.geometry.dims, 1, false);
  for (int k = 0; k < 60; ++k) {
    for (int j = 0; j < 60; ++j) {
      for (int i = 0; i < 60; ++i) {
        map.mask.set(i, j, k, std::abs(test::roomValue(map.geometry.dims, i, j, k)) < 0.2f);
      }
    }
  }
  expectSurvives(map);
  EXPECT_LT(maskBytes(map), 60u * 60u * 60u / 8u / 4u);
}

}  // namespace
}  // namespace ttsdf
