#include "ttsdf_localization/tools/spectra.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace ttsdf {

namespace {

// Singular values of A B from the Gram matrices A^T A and B B^T: roots of the eigenvalues of S A^T A S, S S =
// B B^T.
std::vector<double> productSingularValues(const Eigen::MatrixXd& gram_left,
                                          const Eigen::MatrixXd& gram_right) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> right(gram_right);
  const Eigen::VectorXd roots = right.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  const Eigen::MatrixXd root = right.eigenvectors() * roots.asDiagonal() * right.eigenvectors().transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> product(root * gram_left * root,
                                                               Eigen::EigenvaluesOnly);
  std::vector<double> values;
  for (Eigen::Index n = product.eigenvalues().size() - 1; n >= 0; --n) {
    values.push_back(std::sqrt(std::max(0.0, product.eigenvalues()[n])));
  }
  return values;
}

}  // namespace

Spectra spectra(const TensorTrain& train) {
  const Eigen::MatrixXd first = train.first().cast<double>(), last = train.last().cast<double>();
  const Eigen::MatrixXd gram_first = first.transpose() * first, gram_last = last * last.transpose();
  Eigen::MatrixXd gram_left = Eigen::MatrixXd::Zero(train.rank2(), train.rank2());
  Eigen::MatrixXd gram_right = Eigen::MatrixXd::Zero(train.rank1(), train.rank1());
  for (int j = 0; j < train.modeSizes()[1]; ++j) {
    const Eigen::MatrixXd slice = train.slice(j).cast<double>();
    gram_left += slice.transpose() * gram_first * slice;
    gram_right += slice * gram_last * slice.transpose();
  }
  return {productSingularValues(gram_first, gram_right), productSingularValues(gram_left, gram_last)};
}

}  // namespace ttsdf
