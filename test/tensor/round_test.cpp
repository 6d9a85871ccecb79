#include <gtest/gtest.h>

#include <Eigen/SVD>

#include "test_tensors.h"
#include "ttsdf_localization/compression/tt_svd.h"

namespace ttsdf {
namespace {

using test::allModeOrders;
using test::relativeError;

constexpr double kRounding = 3e-6;  // one more float QR on either side than TT-SVD

double tailShare(const DenseTensor& tensor, const ModeOrder& axes, int left, int rank) {
  const Eigen::MatrixXd matrix = test::unfolding(tensor, axes, left);
  const Eigen::VectorXd values = Eigen::BDCSVD<Eigen::MatrixXd>(matrix).singularValues();
  return rank < values.size() ? values.tail(values.size() - rank).norm() / values.norm() : 0.0;
}

TEST(Round, IsExactWithoutACap) {
  for (const auto& axes : allModeOrders()) {
    const TensorTrain tt = test::randomTrain(axes, {{9, 8, 10}}, 4, 3);
    const TensorTrain rounded = round(tt, {});
    EXPECT_EQ(rounded.axes(), axes);
    EXPECT_LT(relativeError(full(rounded), full(tt)), kRounding);
  }
}

TEST(Round, BringsTheRanksOfASumDownAgain) {
  for (const auto& axes : allModeOrders()) {
    const TensorTrain tt = test::randomTrain(axes, {{9, 8, 10}}, 4, 3);
    TtSvdOptions options;
    options.tolerance = 1e-5;
    const TensorTrain rounded = round(add(tt, scale(tt, 2.0f)), options);
    EXPECT_EQ(rounded.rank1(), 4);
    EXPECT_EQ(rounded.rank2(), 3);
    EXPECT_LT(relativeError(full(rounded), full(scale(tt, 3.0f))), 1e-5);
  }
}

TEST(Round, IsNeverWorseThanItsBound) {
  const DenseTensor tensor = test::distanceTensor(Dims(16, 13, 15));
  for (const auto& axes : allModeOrders()) {
    TtSvdOptions at_full_rank;
    at_full_rank.axes = axes;
    const TensorTrain tt = ttSvd(tensor, at_full_rank).train;
    for (const auto& ranks : {std::array<int, 2>{{1, 1}}, {{3, 6}}, {{6, 3}}, {{9, 9}}}) {
      TtSvdOptions options;
      options.max_rank1 = ranks[0], options.max_rank2 = ranks[1];
      const TensorTrain rounded = round(tt, options);
      EXPECT_LE(rounded.rank1(), ranks[0]);
      EXPECT_LE(rounded.rank2(), ranks[1]);
      const double eps1 = tailShare(tensor, axes, 1, ranks[0]), eps2 = tailShare(tensor, axes, 2, ranks[1]);
      const double error = relativeError(full(rounded), tensor);
      EXPECT_LE(error, std::hypot(eps1, eps2) + kRounding);
      EXPECT_GE(error, std::max(eps1, eps2) - kRounding);
    }
    for (const double tolerance : {1e-3, 1e-2, 1e-1}) {
      TtSvdOptions options;
      options.tolerance = tolerance;
      EXPECT_LE(relativeError(full(round(tt, options)), tensor), tolerance + kRounding);
    }
  }
}

TEST(Round, AcceptsRanksAboveTheModeSizes) {
  for (const auto& n : {std::array<int, 3>{{3, 4, 5}}, {{1, 6, 2}}, {{2, 1, 1}}}) {
    const TensorTrain tt = test::randomTrain({{1, 2, 0}}, n, 8, 9);
    const TensorTrain rounded = round(tt, {});
    EXPECT_LE(rounded.rank1(), std::min(n[0], n[1] * n[2]));
    EXPECT_LE(rounded.rank2(), std::min(n[2], n[0] * n[1]));
    EXPECT_LT(relativeError(full(rounded), full(tt)), kRounding);
  }
}

TEST(Round, KeepsAZeroTrainZero) {
  const TensorTrain rounded = round(scale(test::randomTrain({{0, 1, 2}}, {{6, 5, 7}}, 3, 2), 0.0f), {});
  EXPECT_EQ(rounded.rank1(), 1);
  EXPECT_EQ(rounded.rank2(), 1);
  EXPECT_EQ(norm(rounded), 0.0);
}

}  // namespace
}  // namespace ttsdf
