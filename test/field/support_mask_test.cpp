#include "ttsdf_localization/field/support_mask.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace ttsdf {
namespace {

TEST(SupportMask, EmptyMaskSupportsEverything) {
  const SupportMask mask;
  EXPECT_TRUE(mask.empty());
  EXPECT_TRUE(mask.atVoxel(0, 0, 0));
  EXPECT_TRUE(mask.atVoxel(1000, 2, 3));
  EXPECT_EQ(mask.supportedShare(), 1.0);
  EXPECT_EQ(mask.memoryBytes(), 0u);
}

TEST(SupportMask, CellsCoverTheGridRoundedUp) {
  EXPECT_TRUE((SupportMask(Dims(8, 9, 1), 4, true).cellDims() == Dims(2, 3, 1)).all());
  EXPECT_TRUE((SupportMask(Dims(8, 9, 1), 1, true).cellDims() == Dims(8, 9, 1)).all());
  EXPECT_TRUE((SupportMask(Dims(8, 9, 1), 100, true).cellDims() == Dims(1, 1, 1)).all());
}

TEST(SupportMask, StartsAllOrNothing) {
  for (const bool supported : {true, false}) {
    const SupportMask mask(Dims(13, 7, 9), 2, supported);
    for (int k = 0; k < 9; ++k) {
      for (int j = 0; j < 7; ++j) {
        for (int i = 0; i < 13; ++i) EXPECT_EQ(mask.atVoxel(i, j, k), supported);
      }
    }
    EXPECT_EQ(mask.supportedShare(), supported ? 1.0 : 0.0);
  }
}

TEST(SupportMask, SetsOneCellAndNoOther) {
  const Dims dims(13, 7, 9);
  constexpr int kCell = 2;
  SupportMask mask(dims, kCell, false);
  std::set<std::array<int, 3>> truth;
  std::mt19937 random(1);
  for (int n = 0; n < 300; ++n) {
    const Dims c = mask.cellDims();
    const std::array<int, 3> cell{{static_cast<int>(random() % static_cast<unsigned>(c[0])),
                                   static_cast<int>(random() % static_cast<unsigned>(c[1])),
                                   static_cast<int>(random() % static_cast<unsigned>(c[2]))}};
    const bool supported = random() % 2 == 0;
    mask.set(cell[0], cell[1], cell[2], supported);
    if (supported) {
      truth.insert(cell);
    } else {
      truth.erase(cell);
    }
  }
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i) {
        EXPECT_EQ(mask.atVoxel(i, j, k), truth.count({{i / kCell, j / kCell, k / kCell}}) == 1);
      }
    }
  }
  EXPECT_DOUBLE_EQ(mask.supportedShare(), static_cast<double>(truth.size()) / mask.cellDims().prod());
}

TEST(SupportMask, EqualMasksHaveEqualWords) {
  SupportMask full(Dims(5, 5, 5), 1, true), filled(Dims(5, 5, 5), 1, false);
  for (int c = 0; c < 5; ++c) {
    for (int b = 0; b < 5; ++b) {
      for (int a = 0; a < 5; ++a) filled.set(a, b, c, true);
    }
  }
  EXPECT_EQ(full.bits(), filled.bits());
  EXPECT_EQ(full.memoryBytes(), 2 * sizeof(std::uint64_t));
}

TEST(SupportMask, RefusesExtentsBelowOne) {
  EXPECT_THROW(SupportMask(Dims(0, 5, 5), 4, true), std::invalid_argument);
  EXPECT_THROW(SupportMask(Dims(5, 5, 5), 0, true), std::invalid_argument);
  EXPECT_THROW(SupportMask(Dims(5, 5, 5), -1, true), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
