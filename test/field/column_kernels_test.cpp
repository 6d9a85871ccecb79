#include "../../src/field/column_kernels.h"

#include <gtest/gtest.h>

#include <ostream>
#include <random>
#include <string>
#include <vector>

namespace ttsdf {

void PrintTo(const ColumnKernels& kernels, std::ostream* out) { *out << kernels.name; }

namespace {

std::vector<float> randomFloats(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::vector<float> values(count);
  for (float& v : values) v = normal(random);
  return values;
}

// Sums of up to 100 products of standard normal numbers in float.
constexpr double kRounding = 1e-4;

class ColumnKernelsTest : public testing::TestWithParam<ColumnKernels> {
 protected:
  const ColumnKernels& kernels() const { return GetParam(); }
};

TEST_P(ColumnKernelsTest, ContractsColumns) {
  for (const int r1 : {1, 3, 16, 40}) {
    for (const int width : {16, 48, 80}) {
      const int stride = r1 + 3;
      const auto g = randomFloats(static_cast<std::size_t>(kColumnBlock * stride), 1);
      const auto slice = randomFloats(static_cast<std::size_t>(r1 * width), 2);
      std::vector<float> c(static_cast<std::size_t>(kColumnBlock * width), 99.0f);
      kernels().contract(g.data(), stride, slice.data(), r1, width, c.data());
      for (int q = 0; q < kColumnBlock; ++q) {
        for (int b = 0; b < width; ++b) {
          double sum = 0.0;
          for (int a = 0; a < r1; ++a) {
            sum += static_cast<double>(g[static_cast<std::size_t>(q * stride + a)]) *
                   slice[static_cast<std::size_t>(a * width + b)];
          }
          EXPECT_NEAR(c[static_cast<std::size_t>(q * width + b)], sum, kRounding);
        }
      }
    }
  }
}

TEST_P(ColumnKernelsTest, MultipliesColumnsWithTheLastCore) {
  for (const int width : {16, 32, 48, 80, 112}) {
    const auto data = randomFloats(static_cast<std::size_t>(6 * width), 3);
    const float* const columns[4] = {&data[0], &data[static_cast<std::size_t>(width)],
                                     &data[static_cast<std::size_t>(2 * width)],
                                     &data[static_cast<std::size_t>(3 * width)]};
    const float* const last[2] = {&data[static_cast<std::size_t>(4 * width)],
                                  &data[static_cast<std::size_t>(5 * width)]};
    float out[8];
    kernels().dots(columns, last, width, out);
    for (int n = 0; n < 8; ++n) {
      double sum = 0.0;
      for (int b = 0; b < width; ++b) sum += static_cast<double>(columns[n & 3][b]) * last[n >> 2][b];
      EXPECT_NEAR(out[n], sum, kRounding);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(AllOfThisCpu, ColumnKernelsTest, testing::ValuesIn(availableColumnKernels()),
                         [](const auto& kind) { return std::string(kind.param.name); });

TEST(ColumnKernels, ThePortableOnesAreAlwaysThere) {
  EXPECT_STREQ(columnKernels(true).name, "portable");
  EXPECT_STREQ(columnKernels(false).name, availableColumnKernels().front().name);
}

}  // namespace
}  // namespace ttsdf
