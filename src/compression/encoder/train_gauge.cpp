#include "train_gauge.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

#include "../../tensor/gemm.h"

namespace ttsdf {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;

/// matrix = Q R with orthonormal columns of Q, in double.
struct ThinQr {
  MatrixXd Q, R;
};

ThinQr thinQr(const MatrixXd& matrix) {
  const Index rank = std::min(matrix.rows(), matrix.cols());
  const Eigen::HouseholderQR<MatrixXd> qr(matrix);
  ThinQr result;
  result.Q = qr.householderQ() * MatrixXd::Identity(matrix.rows(), rank);
  result.R = qr.matrixQR().topRows(rank).triangularView<Eigen::Upper>();
  return result;
}

/// Eigenvectors of a Gram matrix that carry anything, strongest first.
MatrixXd principalDirections(const MatrixXd& gram) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(gram);
  const Index n = gram.rows();
  const double floor = 1e-14 * solver.eigenvalues()[n - 1];
  Index kept = 1;
  while (kept < n && solver.eigenvalues()[n - 1 - kept] > floor) ++kept;
  return solver.eigenvectors().rightCols(kept).rowwise().reverse();
}

/// Sum over the slices of M_j M_j^T (first index) or M_j^T M_j (last index).
MatrixXd sliceGram(const MatrixXf& M, Index rank1, bool last) {
  const Index rank2 = M.rows() / rank1, n = last ? rank2 : rank1;
  MatrixXd gram = MatrixXd::Zero(n, n);
  for (Index j = 0; j < M.cols(); ++j) {
    const MatrixXd slice = Eigen::Map<const MatrixXf>(M.col(j).data(), rank1, rank2).cast<double>();
    if (last) {
      gram.noalias() += slice.transpose() * slice;
    } else {
      gram.noalias() += slice * slice.transpose();
    }
  }
  return gram;
}

}  // namespace

TrainGauge orthonormalGauge(const TensorTrain& train) {
  const ThinQr left = thinQr(train.first().cast<double>());
  const ThinQr right = thinQr(train.last().transpose().cast<double>());
  const Index n2 = train.modeSizes()[1], inner = train.rank1() * static_cast<Index>(train.rank2());
  // The cores of a train are one block of memory per slice already.
  const MatrixXf slices = Eigen::Map<const MatrixXf>(train.middle().data(), inner, n2);
  return {train.axes(), left.Q.cast<float>(),
          changeBasis(left.R.cast<float>(), slices, right.R.cast<float>()), right.Q.cast<float>()};
}

TrainGauge principalGauge(const TrainGauge& gauge) {
  const MatrixXd P = principalDirections(sliceGram(gauge.M, gauge.rank1(), false));
  const MatrixXd Q = principalDirections(sliceGram(gauge.M, gauge.rank1(), true));
  return {gauge.axes, (gauge.U.cast<double>() * P).cast<float>(),
          changeBasis(P.transpose().cast<float>(), gauge.M, Q.transpose().cast<float>()),
          (gauge.V.cast<double>() * Q).cast<float>()};
}

Eigen::VectorXd sliceNorms1(const MatrixXf& M, int rank1) {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(rank1);
  for (Index n = 0; n < M.size(); n += rank1) {
    squares += Eigen::Map<const Eigen::VectorXf>(M.data() + n, rank1).cast<double>().cwiseAbs2();
  }
  return squares.cwiseSqrt();
}

Eigen::VectorXd sliceNorms2(const MatrixXf& M, int rank1) {
  const Index rank2 = M.rows() / rank1;
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(rank2);
  for (Index j = 0; j < M.cols(); ++j) {
    squares += Eigen::Map<const MatrixXf>(M.col(j).data(), rank1, rank2)
                   .cast<double>()
                   .colwise()
                   .squaredNorm()
                   .transpose();
  }
  return squares.cwiseSqrt();
}

MatrixXf changeBasis(const MatrixXf& A, const MatrixXf& M, const MatrixXf& B) {
  const Index rank1 = A.cols(), rank2 = B.cols();
  const MatrixXf Bt = B.transpose();
  MatrixXf result(A.rows() * B.rows(), M.cols());
  MatrixXf half(A.rows(), rank2), slice(A.rows(), B.rows());
  for (Index j = 0; j < M.cols(); ++j) {
    gemm(A, Eigen::Map<const MatrixXf>(M.col(j).data(), rank1, rank2), half);
    gemm(half, Bt, slice);
    result.col(j) = Eigen::Map<const Eigen::VectorXf>(slice.data(), slice.size());
  }
  return result;
}

}  // namespace ttsdf
