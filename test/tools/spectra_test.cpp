#include "ttsdf_localization/tools/spectra.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <random>

namespace ttsdf {
namespace {

Eigen::MatrixXf randomMatrix(Eigen::Index rows, Eigen::Index cols, unsigned seed) {
  std::mt19937 random(seed);
  return Eigen::MatrixXf::NullaryExpr(rows, cols,
                                      [&] { return static_cast<float>(random()) / 4294967296.0f - 0.5f; });
}

// Oracle: Jacobi's SVD of the two unfoldings of the full array.
TEST(Spectra, EqualTheSingularValuesOfTheUnfoldings) {
  const TensorTrain train({{0, 1, 2}}, randomMatrix(7, 3, 1), randomMatrix(3, 5 * 4, 2),
                          randomMatrix(4, 6, 3));
  const DenseTensor array = full(train);
  const Eigen::MatrixXd first = Eigen::Map<const Eigen::MatrixXf>(array.data(), 7, 30).cast<double>();
  const Eigen::MatrixXd second = Eigen::Map<const Eigen::MatrixXf>(array.data(), 35, 6).cast<double>();
  const Spectra found = spectra(train);
  ASSERT_EQ(found.first.size(), 3u);
  ASSERT_EQ(found.second.size(), 4u);
  const Eigen::VectorXd wanted1 = first.jacobiSvd().singularValues(),
                        wanted2 = second.jacobiSvd().singularValues();
  for (std::size_t n = 0; n < 3; ++n) EXPECT_NEAR(found.first[n], wanted1[n], 1e-5 * wanted1[0]);
  for (std::size_t n = 0; n < 4; ++n) EXPECT_NEAR(found.second[n], wanted2[n], 1e-5 * wanted2[0]);
}

}  // namespace
}  // namespace ttsdf
