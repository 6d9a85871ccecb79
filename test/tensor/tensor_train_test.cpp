#include "ttsdf_localization/tensor/tensor_train.h"

#include <gtest/gtest.h>

#include <limits>

#include "test_tensors.h"

namespace ttsdf {
namespace {

using test::allModeOrders;
using test::randomTrain;
using test::relativeError;
using test::tabulate;

constexpr double kRounding = 1e-5;  // of float sums of a few hundred products, relative to the tensor's norm

/// The definition, term by term in double.
double entry(const TensorTrain& tt, int x, int y, int z) {
  const std::array<int, 3> index{{x, y, z}};
  const auto& axes = tt.axes();
  const int i = index[static_cast<std::size_t>(axes[0])], j = index[static_cast<std::size_t>(axes[1])],
            k = index[static_cast<std::size_t>(axes[2])];
  double sum = 0.0;
  for (int a = 0; a < tt.rank1(); ++a) {
    for (int b = 0; b < tt.rank2(); ++b) {
      sum += static_cast<double>(tt.first()(i, a)) * tt.middle()(a, j * tt.rank2() + b) * tt.last()(b, k);
    }
  }
  return sum;
}

DenseTensor bruteForce(const TensorTrain& tt) {
  return tabulate(tt.dims(), [&](int x, int y, int z) { return entry(tt, x, y, z); });
}

TEST(DenseTensor, StoresTheFirstIndexFastest) {
  DenseTensor tensor(Dims(2, 3, 4), 1.5f);
  EXPECT_EQ(tensor.size(), 24u);
  EXPECT_EQ(tensor(1, 2, 3), 1.5f);
  tensor(1, 2, 3) = 7.0f;
  EXPECT_EQ(tensor.data()[1 + 2 * (2 + 3 * 3)], 7.0f);
  EXPECT_EQ(DenseTensor().size(), 0u);
  EXPECT_THROW(DenseTensor(Dims(2, 0, 4)), std::invalid_argument);
  EXPECT_THROW(DenseTensor(Dims(-1, 2, 2)), std::invalid_argument);
}

TEST(TensorTrain, EqualsItsDefinitionInEveryModeOrder) {
  for (const auto& axes : allModeOrders()) {
    const TensorTrain tt = randomTrain(axes, {{5, 4, 6}}, 3, 2);
    Dims dims;
    dims[axes[0]] = 5, dims[axes[1]] = 4, dims[axes[2]] = 6;
    ASSERT_TRUE((tt.dims() == dims).all());
    EXPECT_EQ(tt.modeSizes(), (std::array<int, 3>{{5, 4, 6}}));
    EXPECT_EQ(tt.parameterCount(), 5u * 3u + 3u * 4u * 2u + 2u * 6u);
    EXPECT_EQ(tt.memoryBytes(), tt.parameterCount() * 4);
    const DenseTensor truth = bruteForce(tt);
    EXPECT_LT(relativeError(full(tt), truth), kRounding);
    EXPECT_LT(relativeError(tabulate(dims, [&](int x, int y, int z) { return tt(x, y, z); }), truth),
              kRounding);
  }
}

TEST(TensorTrain, RefusesCoresThatDoNotFit) {
  using Eigen::MatrixXf;
  const auto make = [](ModeOrder axes, int n1, int r1, int r1b, int columns, int r2, int n3) {
    return TensorTrain(axes, MatrixXf::Zero(n1, r1), MatrixXf::Zero(r1b, columns), MatrixXf::Zero(r2, n3));
  };
  EXPECT_NO_THROW(make({{0, 1, 2}}, 5, 3, 3, 8, 2, 6));
  EXPECT_THROW(make({{0, 1, 1}}, 5, 3, 3, 8, 2, 6), std::invalid_argument);
  EXPECT_THROW(make({{0, 1, 3}}, 5, 3, 3, 8, 2, 6), std::invalid_argument);
  EXPECT_THROW(make({{0, 1, 2}}, 5, 3, 4, 8, 2, 6), std::invalid_argument);
  EXPECT_THROW(make({{0, 1, 2}}, 5, 3, 3, 7, 2, 6), std::invalid_argument);
  EXPECT_THROW(make({{0, 1, 2}}, 0, 3, 3, 8, 2, 6), std::invalid_argument);
  EXPECT_THROW(make({{0, 1, 2}}, 5, 3, 3, 0, 2, 6), std::invalid_argument);
  EXPECT_THROW(make({{0, 1, 2}}, 5, 3, 3, 8, 0, 6), std::invalid_argument);
  EXPECT_THROW(make({{0, 1, 2}}, 5, 3, 3, 8, 2, 0), std::invalid_argument);
}

TEST(TensorTrain, IsEmptyByDefault) {
  const TensorTrain tt;
  EXPECT_TRUE((tt.dims() == 0).all());
  EXPECT_EQ(tt.parameterCount(), 0u);
}

TEST(TensorTrain, DefaultModeOrderNeedsLeastMemory) {
  for (const Dims& dims : {Dims(346, 153, 152), Dims(9, 8, 7), Dims(7, 8, 9), Dims(8, 7, 9), Dims(5, 5, 5)}) {
    const auto cost = [&](const ModeOrder& axes) {
      constexpr int kRank = 3;
      return dims[axes[0]] * kRank + kRank * dims[axes[1]] * kRank + kRank * dims[axes[2]];
    };
    for (const auto& axes : allModeOrders()) EXPECT_LE(cost(defaultModeOrder(dims)), cost(axes));
  }
  EXPECT_EQ(defaultModeOrder(Dims(346, 153, 152)), (ModeOrder{{0, 2, 1}}));
}

TEST(TensorTrain, AppliesAMatrixToAnyAxis) {
  for (const auto& axes : allModeOrders()) {
    const TensorTrain tt = randomTrain(axes, {{5, 4, 6}}, 3, 2);
    const DenseTensor before = bruteForce(tt);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::MatrixXf matrix = test::randomMatrix(7, tt.dims()[axis], 9);
      Dims dims = tt.dims();
      dims[axis] = 7;
      const DenseTensor truth = tabulate(dims, [&](int x, int y, int z) {
        std::array<int, 3> index{{x, y, z}};
        auto& varied = index[static_cast<std::size_t>(axis)];
        const int row = varied;
        double sum = 0.0;
        for (varied = 0; varied < matrix.cols(); ++varied) {
          sum += static_cast<double>(matrix(row, varied)) * before(index[0], index[1], index[2]);
        }
        return sum;
      });
      EXPECT_LT(relativeError(full(applyToMode(tt, axis, matrix)), truth), kRounding);
    }
    EXPECT_THROW(applyToMode(tt, 0, Eigen::MatrixXf::Zero(3, tt.dims()[0] + 1)), std::invalid_argument);
    EXPECT_THROW(applyToMode(tt, 3, Eigen::MatrixXf::Zero(3, 3)), std::invalid_argument);
    EXPECT_THROW(applyToMode(tt, -1, Eigen::MatrixXf::Zero(3, 3)), std::invalid_argument);
  }
}

TEST(TensorTrain, AddsAndScalesAsTheArraysDo) {
  for (const auto& axes : allModeOrders()) {
    const TensorTrain a = randomTrain(axes, {{5, 4, 6}}, 3, 2, 1),
                      b = randomTrain(axes, {{5, 4, 6}}, 2, 4, 2);
    const TensorTrain sum = add(a, scale(b, -0.5f));
    EXPECT_EQ(sum.rank1(), 5);
    EXPECT_EQ(sum.rank2(), 6);
    const DenseTensor truth =
        tabulate(a.dims(), [&](int x, int y, int z) { return entry(a, x, y, z) - 0.5 * entry(b, x, y, z); });
    EXPECT_LT(relativeError(full(sum), truth), kRounding);
  }
  const TensorTrain a = randomTrain({{0, 1, 2}}, {{5, 4, 6}}, 3, 2);
  EXPECT_THROW(add(a, randomTrain({{0, 1, 2}}, {{5, 4, 7}}, 3, 2)), std::invalid_argument);
  EXPECT_THROW(add(a, randomTrain({{2, 1, 0}}, {{6, 4, 5}}, 3, 2)), std::invalid_argument);
}

TEST(TensorTrain, CropsAsTheArrayDoes) {
  for (const auto& axes : allModeOrders()) {
    const TensorTrain tt = randomTrain(axes, {{5, 4, 6}}, 3, 2);
    const Dims begin(1, 2, 0), size(tt.dims() - begin - Dims(1, 0, 2));
    const DenseTensor truth = tabulate(
        size, [&](int x, int y, int z) { return entry(tt, x + begin[0], y + begin[1], z + begin[2]); });
    const TensorTrain part = crop(tt, begin, size);
    ASSERT_TRUE((part.dims() == size).all());
    EXPECT_LT(relativeError(full(part), truth), kRounding);
    EXPECT_LT(relativeError(full(crop(tt, Dims(0, 0, 0), tt.dims())), bruteForce(tt)), kRounding);
  }
  const TensorTrain tt = randomTrain({{0, 1, 2}}, {{5, 4, 6}}, 3, 2);
  const int huge = std::numeric_limits<int>::max();
  EXPECT_THROW(crop(tt, Dims(-1, 0, 0), Dims(2, 2, 2)), std::invalid_argument);
  EXPECT_THROW(crop(tt, Dims(0, 0, 0), Dims(2, 0, 2)), std::invalid_argument);
  EXPECT_THROW(crop(tt, Dims(0, 0, 1), Dims(5, 4, 6)), std::invalid_argument);
  EXPECT_THROW(crop(tt, Dims(1, 0, 0), Dims(huge, 1, 1)), std::invalid_argument);
}

TEST(TensorTrain, NormIsTheFrobeniusNormOfTheArray) {
  for (const auto& axes : allModeOrders()) {
    const TensorTrain tt = randomTrain(axes, {{5, 4, 6}}, 3, 2);
    EXPECT_NEAR(norm(tt), test::norm(bruteForce(tt)), 1e-6 * norm(tt));
  }
  EXPECT_EQ(norm(scale(randomTrain({{0, 1, 2}}, {{5, 4, 6}}, 3, 2), 0.0f)), 0.0);
}

TEST(TensorTrain, DifferenceOfATrainWithItselfHasNormZeroUpToRounding) {
  const TensorTrain tt = randomTrain({{0, 1, 2}}, {{5, 4, 6}}, 3, 2);
  EXPECT_LT(norm(add(tt, scale(tt, -1.0f))), 1e-7 * norm(tt));
}

}  // namespace
}  // namespace ttsdf
