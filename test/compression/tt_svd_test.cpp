#include "ttsdf_localization/compression/tt_svd.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <limits>

#include "../tensor/test_tensors.h"

namespace ttsdf {
namespace {

using test::allModeOrders;
using test::distanceTensor;
using test::relativeError;
using test::tabulate;

// Cores are float: products of orthonormal factors with 6e-8 each, and sums over up to 40 of them.
constexpr double kRounding = 2e-6;

/// Singular values of an unfolding by Eigen's divide-and-conquer SVD in double.
Eigen::VectorXd singularValues(const Eigen::MatrixXd& matrix) {
  return Eigen::BDCSVD<Eigen::MatrixXd>(matrix).singularValues();
}

double tail(const Eigen::VectorXd& values, Eigen::Index rank) {
  return rank < values.size() ? values.tail(values.size() - rank).norm() : 0.0;
}

TtSvdOptions withRanks(int r1, int r2, const ModeOrder& axes) {
  TtSvdOptions options;
  options.max_rank1 = r1, options.max_rank2 = r2, options.axes = axes;
  return options;
}

TEST(TtSvd, ReachesRequestedTolerance) {
  const DenseTensor tensor = distanceTensor(Dims(24, 17, 20));
  for (const auto& axes : allModeOrders()) {
    int previous = 1000;
    for (const double tolerance : {1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 2.0}) {
      TtSvdOptions options;
      options.tolerance = tolerance, options.axes = axes;
      const TtSvdResult result = ttSvd(tensor, options);
      const double error = relativeError(full(result.train), tensor);
      EXPECT_LE(error, tolerance + kRounding);
      EXPECT_LE(result.relative_error, tolerance);
      EXPECT_LE(error, result.relative_error + kRounding) << "the reported bound must hold";
      EXPECT_EQ(result.train.axes(), axes);
      EXPECT_LE(result.train.rank1() + result.train.rank2(), previous) << "a looser tolerance needs no more";
      previous = result.train.rank1() + result.train.rank2();
    }
  }
}

TEST(TtSvd, SpendsNoRankThatTheToleranceDoesNotNeed) {
  const DenseTensor tensor = distanceTensor(Dims(24, 17, 20));
  TtSvdOptions options;
  options.tolerance = 1e-2, options.axes = ModeOrder{{0, 1, 2}};
  const TtSvdResult result = ttSvd(tensor, options);
  // Each truncation may take half of the squared error.
  const double allowed = options.tolerance * test::norm(tensor) / std::sqrt(2.0);
  const Eigen::VectorXd values = singularValues(test::unfolding(tensor, *options.axes, 1));
  const Eigen::Index rank = result.train.rank1();
  EXPECT_LE(tail(values, rank), allowed * (1.0 + 1e-6));
  EXPECT_GT(tail(values, rank - 1), allowed);
}

TEST(TtSvd, IsQuasiOptimalUnderRankCaps) {
  const DenseTensor tensor = distanceTensor(Dims(24, 17, 20));
  const double size = test::norm(tensor);
  for (const auto& axes : allModeOrders()) {
    const Eigen::VectorXd first = singularValues(test::unfolding(tensor, axes, 1)),
                          second = singularValues(test::unfolding(tensor, axes, 2));
    for (const auto& ranks : {std::array<int, 2>{{1, 1}}, {{2, 5}}, {{5, 2}}, {{8, 8}}, {{12, 17}}}) {
      const TtSvdResult result = ttSvd(tensor, withRanks(ranks[0], ranks[1], axes));
      EXPECT_LE(result.train.rank1(), ranks[0]);
      EXPECT_LE(result.train.rank2(), ranks[1]);
      const double eps1 = tail(first, ranks[0]) / size, eps2 = tail(second, ranks[1]) / size;
      const double error = relativeError(full(result.train), tensor);
      EXPECT_LE(error, std::hypot(eps1, eps2) + kRounding);
      EXPECT_GE(error, std::max(eps1, eps2) - kRounding) << "no train of these ranks can be nearer";
      EXPECT_NEAR(error, result.relative_error, kRounding);
    }
  }
}

TEST(TtSvd, SpectraAreTheSingularValuesOfTheUnfoldings) {
  const DenseTensor tensor = distanceTensor(Dims(24, 17, 20));
  const ModeOrder axes{{0, 1, 2}};
  const TtSvdResult result = ttSvd(tensor, withRanks(0, 0, axes));
  const Eigen::VectorXd first = singularValues(test::unfolding(tensor, axes, 1)),
                        second = singularValues(test::unfolding(tensor, axes, 2));
  ASSERT_EQ(result.spectrum1.size(), 24u);
  ASSERT_EQ(result.spectrum2.size(), 20u);
  // Gram matrices square the condition: absolute accuracy about sqrt(1e-16) of the largest.
  for (int n = 0; n < 24; ++n)
    EXPECT_NEAR(result.spectrum1[static_cast<std::size_t>(n)], first[n], 1e-6 * first[0]);
  for (int n = 0; n < 20; ++n)
    EXPECT_NEAR(result.spectrum2[static_cast<std::size_t>(n)], second[n], 1e-6 * second[0]);
  EXPECT_TRUE(std::is_sorted(result.spectrum1.rbegin(), result.spectrum1.rend()));
}

TEST(TtSvd, IsExactAtFullRank) {
  for (const auto& axes : allModeOrders()) {
    for (const DenseTensor& tensor : {distanceTensor(Dims(13, 8, 11)), test::noiseTensor(Dims(7, 12, 9))}) {
      const TtSvdResult result = ttSvd(tensor, withRanks(0, 0, axes));
      EXPECT_LT(relativeError(full(result.train), tensor), kRounding);
      EXPECT_LT(result.relative_error, 1e-7);
    }
  }
}

TEST(TtSvd, FindsTheRanksOfALowRankTensor) {
  for (const auto& axes : allModeOrders()) {
    const DenseTensor tensor = full(test::randomTrain(axes, {{9, 8, 10}}, 4, 3));
    TtSvdOptions options;
    options.tolerance = 1e-5, options.axes = axes;
    const TtSvdResult result = ttSvd(tensor, options);
    EXPECT_EQ(result.train.rank1(), 4);
    EXPECT_EQ(result.train.rank2(), 3);
    EXPECT_LT(relativeError(full(result.train), tensor), 1e-5);
  }
}

TEST(TtSvd, TakesTheDefaultModeOrder) {
  const TtSvdResult result = ttSvd(distanceTensor(Dims(9, 12, 6)), {});
  EXPECT_EQ(result.train.axes(), defaultModeOrder(Dims(9, 12, 6)));
}

TEST(TtSvd, StreamedEqualsDenseAndAsksForEverySlabTwice) {
  const DenseTensor tensor = distanceTensor(Dims(14, 9, 12));
  for (const auto& axes : allModeOrders()) {
    const TtSvdOptions options = withRanks(6, 7, axes);
    std::vector<int> asked(static_cast<std::size_t>(tensor.dims()[axes[1]]), 0);
    const SlabSource source = [&](int j, Eigen::Ref<Eigen::MatrixXf> slab) {
      ++asked[static_cast<std::size_t>(j)];
      ASSERT_EQ(slab.rows(), tensor.dims()[axes[0]]);
      ASSERT_EQ(slab.cols(), tensor.dims()[axes[2]]);
      std::array<int, 3> index{};
      index[static_cast<std::size_t>(axes[1])] = j;
      for (int k = 0; k < slab.cols(); ++k) {
        index[static_cast<std::size_t>(axes[2])] = k;
        for (int i = 0; i < slab.rows(); ++i) {
          index[static_cast<std::size_t>(axes[0])] = i;
          slab(i, k) = tensor(index[0], index[1], index[2]);
        }
      }
    };
    const TtSvdResult streamed = ttSvd(tensor.dims(), source, options), dense = ttSvd(tensor, options);
    EXPECT_EQ(streamed.train.first(), dense.train.first());
    EXPECT_EQ(streamed.train.middle(), dense.train.middle());
    EXPECT_EQ(streamed.train.last(), dense.train.last());
    EXPECT_EQ(streamed.relative_error, dense.relative_error);
    for (const int count : asked) EXPECT_EQ(count, 2);
  }
}

TEST(TtSvd, HandlesModesOfLengthOneAndTwo) {
  for (const Dims& dims :
       {Dims(1, 1, 1), Dims(1, 1, 9), Dims(1, 9, 1), Dims(9, 1, 1), Dims(1, 5, 6), Dims(5, 1, 6),
        Dims(5, 6, 1), Dims(2, 2, 2), Dims(2, 9, 8), Dims(9, 2, 1), Dims(2, 1, 40)}) {
    const DenseTensor tensor = test::noiseTensor(dims);
    for (const auto& axes : allModeOrders()) {
      const TtSvdResult result = ttSvd(tensor, withRanks(0, 0, axes));
      EXPECT_TRUE((result.train.dims() == dims).all());
      EXPECT_LT(relativeError(full(result.train), tensor), kRounding) << dims.transpose();
      const TtSvdResult one = ttSvd(tensor, withRanks(1, 1, axes));
      EXPECT_EQ(one.train.rank1(), 1);
      EXPECT_EQ(one.train.rank2(), 1);
      EXPECT_LE(relativeError(full(one.train), tensor), 1.0);
    }
  }
}

TEST(TtSvd, RanksNeverExceedWhatTheExtentsAllow) {
  // Noise has full rank: rounding in a Gram matrix must not pass for more.
  for (const Dims& dims : {Dims(40, 2, 3), Dims(2, 3, 40), Dims(3, 40, 2), Dims(50, 1, 2), Dims(6, 5, 4)}) {
    for (const auto& axes : allModeOrders()) {
      const TtSvdResult result = ttSvd(test::noiseTensor(dims), withRanks(1000, 1000, axes));
      const int n1 = dims[axes[0]], n2 = dims[axes[1]], n3 = dims[axes[2]];
      EXPECT_EQ(result.train.rank1(), std::min(n1, n2 * n3)) << dims.transpose();
      EXPECT_EQ(result.train.rank2(), std::min(n3, n1 * n2)) << dims.transpose();
      EXPECT_LT(relativeError(full(result.train), test::noiseTensor(dims)), kRounding);
    }
  }
}

TEST(TtSvd, ZeroAndConstantTensorsHaveRankOne) {
  for (const float value : {0.0f, 1.0f, -0.3f, 1e-20f, 1e15f}) {
    const DenseTensor tensor(Dims(6, 5, 7), value);
    for (const double tolerance : {0.0, 1e-3}) {
      TtSvdOptions options;
      options.tolerance = tolerance;
      const TtSvdResult result = ttSvd(tensor, options);
      EXPECT_LT(relativeError(full(result.train), tensor), 1e-3 + kRounding) << value;
      if (value == 0.0f) {
        EXPECT_EQ(result.train.rank1(), 1);
        EXPECT_EQ(result.train.rank2(), 1);
        EXPECT_EQ(norm(result.train), 0.0);
        EXPECT_EQ(result.relative_error, 0.0);
      } else if (tolerance > 0.0) {
        EXPECT_EQ(result.train.rank1(), 1) << value;
        EXPECT_EQ(result.train.rank2(), 1) << value;
      }
    }
  }
}

TEST(TtSvd, IsDeterministic) {
  const DenseTensor tensor = distanceTensor(Dims(14, 9, 12));
  const TtSvdResult a = ttSvd(tensor, {}), b = ttSvd(tensor, {});
  EXPECT_EQ(a.train.first(), b.train.first());
  EXPECT_EQ(a.train.middle(), b.train.middle());
  EXPECT_EQ(a.train.last(), b.train.last());
}

TEST(TtSvd, RefusesBadOptionsAndBadEntries) {
  const DenseTensor tensor = distanceTensor(Dims(6, 5, 4));
  const auto refused = [&](auto change) {
    TtSvdOptions options;
    change(options);
    EXPECT_THROW(ttSvd(tensor, options), std::invalid_argument);
    EXPECT_THROW(round(ttSvd(tensor, {}).train, options), std::invalid_argument);
  };
  refused([](TtSvdOptions& o) { o.max_rank1 = -1; });
  refused([](TtSvdOptions& o) { o.max_rank2 = -1; });
  refused([](TtSvdOptions& o) { o.tolerance = -1e-3; });
  refused([](TtSvdOptions& o) { o.tolerance = std::nan(""); });
  for (const ModeOrder& axes : {ModeOrder{{0, 1, 1}}, ModeOrder{{0, 1, 3}}, ModeOrder{{-1, 0, 1}}}) {
    TtSvdOptions options;
    options.axes = axes;
    EXPECT_THROW(ttSvd(tensor, options), std::invalid_argument);
  }
  EXPECT_THROW(ttSvd(DenseTensor(), {}), std::invalid_argument);
  EXPECT_THROW(ttSvd(Dims(3, 0, 3), [](int, Eigen::Ref<Eigen::MatrixXf>) {}, {}), std::invalid_argument);
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    DenseTensor spoilt = tensor;
    spoilt(3, 2, 1) = bad;
    EXPECT_THROW(ttSvd(spoilt, {}), std::invalid_argument);
  }
}

}  // namespace
}  // namespace ttsdf
