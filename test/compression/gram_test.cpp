#include "../../src/compression/gram.h"

#include <gtest/gtest.h>

#include "../tensor/test_tensors.h"

namespace ttsdf {
namespace {

TEST(Gram, EqualsTheProductInDouble) {
  // Rows around the tile of 8, columns around the panel of 256.
  for (const int rows : {1, 2, 7, 8, 9, 16, 33}) {
    for (const int columns : {1, 255, 256, 257, 700}) {
      const Eigen::MatrixXf A = test::randomMatrix(rows, columns, static_cast<unsigned>(rows * columns));
      const Eigen::MatrixXd truth = A.cast<double>() * A.cast<double>().transpose();
      for (const int vector_bytes : gramVectorBytes()) {
        Eigen::MatrixXd gram = Eigen::MatrixXd::Constant(rows, rows, 0.5);
        addGram(A, gram, vector_bytes);
        for (int i = 0; i < rows; ++i) {
          for (int j = 0; j <= i; ++j)
            EXPECT_NEAR(gram(i, j), truth(i, j) + 0.5, 1e-12 * columns) << rows << "x" << columns;
        }
      }
    }
  }
}

TEST(Gram, TakesAPartOfALargerMatrix) {
  const Eigen::MatrixXf A = test::randomMatrix(20, 50, 1);
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(5, 5);
  addGram(A.block(3, 10, 5, 30), gram);
  const Eigen::MatrixXd part = A.block(3, 10, 5, 30).cast<double>();
  EXPECT_LT(
      ((part * part.transpose()) - gram).triangularView<Eigen::Lower>().toDenseMatrix().cwiseAbs().maxCoeff(),
      1e-12);
}

}  // namespace
}  // namespace ttsdf
