#include "ttsdf_localization/signed_field/field_bricks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace ttsdf {
namespace {

constexpr float kLow = -0.06F, kHigh = 0.2F;
constexpr float kStep = (kHigh - kLow) / 32766.0F;

/// Samples of a whole grid as plain arrays.
struct Arrays {
  explicit Arrays(const Dims& dims) : values(dims), known(values.size(), 1), loose(values.size(), 0) {}
  DenseTensor values;
  std::vector<std::uint8_t> known, loose;

  /// Stores the box [begin, begin + size).
  void store(FieldBricks& bricks, const Dims& begin, const Dims& size) const {
    const std::size_t n = values.offset(begin[0], begin[1], begin[2]);
    FieldBricks::Samples samples{values.data() + n, known.data() + n, loose.data() + n, {}};
    samples.strides << 1, values.dims()[0], values.dims()[0] * values.dims()[1];
    bricks.store(begin, size, samples);
  }
};

Arrays wave(const Dims& dims) {
  Arrays arrays(dims);
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i) {
        const std::size_t n = arrays.values.offset(i, j, k);
        arrays.values.data()[n] = 0.07F + 0.13F * std::sin(0.3F * static_cast<float>(i + 2 * j - k));
        arrays.known[n] = (i * j + k) % 3 != 0 ? 1 : 0;
      }
    }
  }
  return arrays;
}

TEST(FieldBricks, ReadsBackWhatWasStoredAlongEveryAxis) {
  const Dims dims(21, 16, 13);
  const Arrays arrays = wave(dims);
  FieldBricks bricks(dims, kLow, kHigh);
  arrays.store(bricks, {0, 0, 0}, {16, 16, 8});
  arrays.store(bricks, {16, 0, 0}, {5, 16, 8});
  arrays.store(bricks, {0, 0, 8}, {21, 16, 5});
  bricks.fillLoose(2);
  for (int axis = 0; axis < 3; ++axis) {
    const int rows = (axis + 1) % 3, columns = (axis + 2) % 3;
    std::vector<float> values(static_cast<std::size_t>(dims[rows] * dims[columns]));
    std::vector<std::uint8_t> known(values.size());
    for (int index = 0; index < dims[axis]; ++index) {
      bricks.readSlab({axis, index, rows, columns, 0, bricks.dims()[columns]}, values.data(), known.data());
      for (int c = 0; c < dims[columns]; ++c) {
        for (int r = 0; r < dims[rows]; ++r) {
          Dims at;
          at[axis] = index, at[rows] = r, at[columns] = c;
          const std::size_t n = arrays.values.offset(at[0], at[1], at[2]);
          const auto m = static_cast<std::size_t>(r + dims[rows] * c);
          ASSERT_NEAR(values[m], arrays.values.data()[n], 0.51F * kStep) << at.transpose();
          ASSERT_EQ(known[m], arrays.known[n]) << at.transpose();
        }
      }
      const auto skipped = static_cast<std::size_t>(8 * dims[rows]);
      std::vector<float> rest(values.size() - skipped);
      bricks.readSlab({axis, index, rows, columns, 8, dims[columns] - 8}, rest.data(), nullptr);
      ASSERT_TRUE(
          std::equal(rest.begin(), rest.end(), values.begin() + static_cast<std::ptrdiff_t>(skipped)));
    }
  }
}

TEST(FieldBricks, KeepsTheClampsExactlyAndConstantBricksSmall) {
  const Dims dims(64, 64, 64);
  Arrays arrays(dims);
  std::fill_n(arrays.values.data(), arrays.values.size(), kHigh);
  std::fill_n(arrays.values.data(), 64 * 64 * 32, kLow);
  FieldBricks bricks(dims, kLow, kHigh);
  arrays.store(bricks, Dims::Zero(), dims);
  EXPECT_LT(bricks.memoryBytes(), 20000u);
  std::vector<float> values(64 * 64);
  bricks.readSlab({2, 10, 0, 1, 0, bricks.dims()[1]}, values.data(), nullptr);
  EXPECT_EQ(values[77], kLow);
  bricks.readSlab({2, 40, 0, 1, 0, bricks.dims()[1]}, values.data(), nullptr);
  EXPECT_NEAR(values[77], kHigh, 1e-7F);
}

/// Half of the grid means nothing: it takes the other half's value, without a step where the boxes meet.
TEST(FieldBricks, GivesLooseSamplesASmoothCourseAcrossBoxes) {
  const Dims dims(64, 32, 32);
  Arrays arrays(dims);
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i) {
        const std::size_t n = arrays.values.offset(i, j, k);
        arrays.values.data()[n] = i < 12 ? 0.1F : -0.05F;
        arrays.known[n] = i < 12 || i >= 52 ? 1 : 0;
        arrays.loose[n] = arrays.known[n] ? 0 : 1;
      }
    }
  }
  FieldBricks bricks(dims, kLow, kHigh);
  arrays.store(bricks, {0, 0, 0}, {32, 32, 32});
  arrays.store(bricks, {32, 0, 0}, {32, 32, 32});
  bricks.fillLoose(1);
  std::vector<float> values(64 * 32);
  bricks.readSlab({2, 20, 0, 1, 0, bricks.dims()[1]}, values.data(), nullptr);
  for (std::size_t i = 16; i + 1 < 48; ++i) {
    const float step = values[64 * 15 + i + 1] - values[64 * 15 + i];
    EXPECT_LE(step, 1e-3F) << i;
    EXPECT_GE(step, -0.02F) << i;
  }
}

TEST(FieldBricks, RefusesWhatItCannotKeep) {
  EXPECT_THROW(FieldBricks({0, 8, 8}, kLow, kHigh), std::invalid_argument);
  EXPECT_THROW(FieldBricks({8, 8, 8}, 0.1F, 0.1F), std::invalid_argument);
  const Arrays arrays{Dims(24, 16, 16)};
  FieldBricks bricks({24, 16, 16}, kLow, kHigh);
  EXPECT_THROW(arrays.store(bricks, {4, 0, 0}, {8, 8, 8}), std::invalid_argument);
  EXPECT_THROW(arrays.store(bricks, {0, 0, 0}, {12, 16, 16}), std::invalid_argument);
  EXPECT_THROW(arrays.store(bricks, {16, 0, 0}, {16, 16, 16}), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
