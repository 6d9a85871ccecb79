// Finite differences on the cores, against polynomials, the dense array, and the matrix that the paper
// prints.

#include <gtest/gtest.h>

#include "test_tensors.h"
#include "ttsdf_localization/compression/tt_svd.h"
#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {
namespace {

using test::allModeOrders;
using test::tabulate;

constexpr double kStep = 0.05;  // [m]

/// A train that equals p(x) = c0 + c1 t + c2 t^2 along one axis, t = kStep * index, times 1 elsewhere.
TensorTrain polynomial(const ModeOrder& axes, const Dims& dims, int axis, const Eigen::Vector3d& c) {
  const DenseTensor tensor = tabulate(dims, [&](int x, int y, int z) {
    const std::array<int, 3> index{{x, y, z}};
    const double t = kStep * index[static_cast<std::size_t>(axis)];
    return c[0] + c[1] * t + c[2] * t * t;
  });
  TtSvdOptions options;
  options.axes = axes;
  return ttSvd(tensor, options).train;
}

double worstSlopeError(const TensorTrain& derivative, int axis, const Eigen::Vector3d& c) {
  const DenseTensor values = full(derivative);
  double worst = 0.0;
  const Dims& dims = values.dims();
  for (int z = 0; z < dims[2]; ++z) {
    for (int y = 0; y < dims[1]; ++y) {
      for (int x = 0; x < dims[0]; ++x) {
        const std::array<int, 3> index{{x, y, z}};
        const double t = kStep * index[static_cast<std::size_t>(axis)];
        worst = std::max(worst, std::abs(values(x, y, z) - (c[1] + 2.0 * c[2] * t)));
      }
    }
  }
  return worst;
}

/// D_N exactly as the paper prints it (equation (finitediff)).
Eigen::MatrixXf printedMatrix(int n) {
  Eigen::MatrixXf D = Eigen::MatrixXf::Zero(n, n);
  D(0, 0) = -1.5f, D(0, 1) = 2.0f, D(0, 2) = -0.5f;
  for (int k = 1; k + 1 < n; ++k) D(k, k - 1) = 0.5f, D(k, k + 1) = -0.5f;
  D(n - 1, n - 3) = -0.5f, D(n - 1, n - 2) = 2.0f, D(n - 1, n - 1) = -1.5f;
  return D / static_cast<float>(kStep);
}

TEST(Differentiate, IsExactOnPolynomialsUpToDegreeTwoAtTheBordersToo) {
  const std::vector<Eigen::Vector3d> polynomials{
      {3.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {-1.0, 2.0, 0.0}, {0.5, -1.0, 3.0}};
  for (const auto& axes : allModeOrders()) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const auto& c : polynomials) {
        const TensorTrain tt = polynomial(axes, Dims(9, 7, 5), axis, c);
        // Values of a few metres in float, divided by the step: 1e-6 / 0.05.
        EXPECT_LT(worstSlopeError(differentiate(tt, axis, kStep), axis, c), 1e-4)
            << axis << ": " << c.transpose();
        for (int other = 0; other < 3; ++other) {
          if (other == axis) continue;
          EXPECT_LT(worstSlopeError(differentiate(tt, other, kStep), axis, Eigen::Vector3d::Zero()), 1e-4);
        }
      }
    }
  }
}

TEST(Differentiate, ThePrintedMatrixFailsOnTheIdentity) {
  // Deviation from the paper, pinned: for f = x its interior and last rows give -1 instead of +1.
  const Eigen::Vector3d line(0.0, 1.0, 0.0);
  const TensorTrain tt = polynomial({{0, 1, 2}}, Dims(9, 7, 5), 0, line);
  const DenseTensor printed = full(applyToMode(tt, 0, printedMatrix(9)));
  EXPECT_NEAR(printed(0, 3, 2), 1.0, 1e-4);
  EXPECT_NEAR(printed(4, 3, 2), -1.0, 1e-4);
  EXPECT_NEAR(printed(8, 3, 2), -1.0, 1e-4);
  EXPECT_LT(worstSlopeError(differentiate(tt, 0, kStep), 0, line), 1e-4);
}

TEST(Differentiate, ErrorFallsWithTheSquareOfTheStep) {
  const auto worst = [](int n) {
    const double h = 1.0 / (n - 1);
    const DenseTensor tensor =
        tabulate(Dims(n, 3, 3), [&](int x, int, int) { return std::sin(3.0 * h * x); });
    const DenseTensor slope = full(differentiate(ttSvd(tensor, {}).train, 0, h));
    double error = 0.0;
    for (int x = 0; x < n; ++x)
      error = std::max(error, std::abs(slope(x, 1, 1) - 3.0 * std::cos(3.0 * h * x)));
    return error;
  };
  const double coarse = worst(11), fine = worst(21), finest = worst(41);
  EXPECT_GT(coarse / fine, 3.4);
  EXPECT_LT(coarse / fine, 4.6);
  EXPECT_GT(fine / finest, 3.4);
  EXPECT_LT(fine / finest, 4.6);
}

TEST(Differentiate, UsesTheDifferenceQuotientOfTwoSamplesAndZeroForOne) {
  const DenseTensor tensor = tabulate(Dims(2, 1, 4), [](int x, int, int z) { return 3.0 * x + z; });
  const TensorTrain tt = ttSvd(tensor, {}).train;
  const DenseTensor along_x = full(differentiate(tt, 0, 0.5)), along_y = full(differentiate(tt, 1, 0.5));
  for (int z = 0; z < 4; ++z) {
    for (int x = 0; x < 2; ++x) {
      EXPECT_NEAR(along_x(x, 0, z), 6.0, 1e-4);
      EXPECT_EQ(along_y(x, 0, z), 0.0f);
    }
  }
}

TEST(Differentiate, KeepsRanksAndTouchesOneCore) {
  const TensorTrain tt = test::randomTrain({{0, 2, 1}}, {{6, 5, 7}}, 4, 3);
  const TensorTrain d = differentiate(tt, 0, kStep);
  EXPECT_EQ(d.rank1(), 4);
  EXPECT_EQ(d.rank2(), 3);
  EXPECT_EQ(d.middle(), tt.middle());
  EXPECT_EQ(d.last(), tt.last());
}

TEST(Differentiate, RefusesAStepOrAnAxisThatIsNone) {
  const TensorTrain tt = test::randomTrain({{0, 1, 2}}, {{6, 5, 7}}, 2, 2);
  for (const double step : {0.0, -1.0, std::nan("")}) {
    EXPECT_THROW(differentiate(tt, 0, step), std::invalid_argument) << step;
  }
  EXPECT_THROW(differentiate(tt, 3, kStep), std::invalid_argument);
  EXPECT_THROW(differentiate(tt, -1, kStep), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
