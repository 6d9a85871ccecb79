#include "ttsdf_localization/evaluation/statistics.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

namespace ttsdf {
namespace {

// Reference: numpy.percentile([15, 20, 35, 40, 50], [25, 50, 75, 40]) and R's quantile(type = 7).
TEST(Quantile, MatchesNumpyOnAnOddList) {
  const std::vector<double> values{50, 15, 40, 20, 35};
  EXPECT_DOUBLE_EQ(quantile(values, 0.25), 20.0);
  EXPECT_DOUBLE_EQ(quantile(values, 0.5), 35.0);
  EXPECT_DOUBLE_EQ(quantile(values, 0.75), 40.0);
  EXPECT_DOUBLE_EQ(quantile(values, 0.4), 29.0);
}

// Reference: numpy.percentile([3, 6, 7, 8, 8, 10, 13, 15, 16, 20], [25, 50, 75]) = 7.25, 9, 14.5.
TEST(Quantile, MatchesNumpyOnAnEvenList) {
  const Quartiles q = quartiles({3, 6, 7, 8, 8, 10, 13, 15, 16, 20});
  EXPECT_DOUBLE_EQ(q.q1, 7.25);
  EXPECT_DOUBLE_EQ(q.median, 9.0);
  EXPECT_DOUBLE_EQ(q.q3, 14.5);
}

TEST(Quantile, EndsAreSmallestAndLargest) {
  EXPECT_DOUBLE_EQ(quantile({2, 9, 4}, 0.0), 2.0);
  EXPECT_DOUBLE_EQ(quantile({2, 9, 4}, 1.0), 9.0);
  EXPECT_DOUBLE_EQ(quantile({7}, 0.3), 7.0);
}

TEST(Quantile, AnInfiniteFailureDoesNotSpoilTheMedian) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_DOUBLE_EQ(quantile({1, 2, infinity}, 0.5), 2.0);
}

TEST(Quantile, RefusesEmptyNanAndBadShare) {
  EXPECT_THROW(quantile({}, 0.5), std::invalid_argument);
  EXPECT_THROW(quantile({1.0, std::numeric_limits<double>::quiet_NaN()}, 0.5), std::invalid_argument);
  EXPECT_THROW(quantile({1.0}, 1.5), std::invalid_argument);
  EXPECT_THROW(quantile({1.0}, -0.1), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
