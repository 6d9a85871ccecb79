#include "ttsdf_localization/compression/tt_weighted.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "../tensor/gemm.h"
#include "../tensor/slab_parts.h"

namespace ttsdf {

namespace {

using Eigen::Index;
using Eigen::MatrixXf;

/// The array and its weights as n1 x n3 slabs, one per middle index, side by side.
struct Slabs {
  MatrixXf values, weights;
  std::array<int, 3> sizes{};
  auto value(int j) const { return values.middleCols(static_cast<Index>(j) * sizes[2], sizes[2]); }
  auto weight(int j) const { return weights.middleCols(static_cast<Index>(j) * sizes[2], sizes[2]); }
};

Slabs makeSlabs(const DenseTensor& tensor, const std::vector<float>& weights, const TensorTrain& train) {
  if ((tensor.dims() != train.dims()).any() || weights.size() != tensor.size()) {
    std::ostringstream text;
    text << "fitWeighted: got a tensor of " << tensor.dims().transpose() << " with " << weights.size()
         << " weights and a train of " << train.dims().transpose() << ", wanted equal shapes";
    throw std::invalid_argument(text.str());
  }
  Slabs slabs;
  slabs.sizes = train.modeSizes();
  const auto [n1, n2, n3] = slabs.sizes;
  slabs.values.resize(n1, static_cast<Index>(n2) * n3);
  slabs.weights.resize(n1, static_cast<Index>(n2) * n3);
  std::array<int, 3> index{};
  const auto& axes = train.axes();
  for (int j = 0; j < n2; ++j) {
    index[static_cast<std::size_t>(axes[1])] = j;
    for (int k = 0; k < n3; ++k) {
      index[static_cast<std::size_t>(axes[2])] = k;
      for (int i = 0; i < n1; ++i) {
        index[static_cast<std::size_t>(axes[0])] = i;
        const std::size_t n = tensor.offset(index[0], index[1], index[2]);
        slabs.values(i, static_cast<Index>(j) * n3 + k) = tensor.data()[n];
        slabs.weights(i, static_cast<Index>(j) * n3 + k) = weights[n];
      }
    }
  }
  return slabs;
}

MatrixXf orthonormalColumns(const MatrixXf& M) {
  const Eigen::HouseholderQR<MatrixXf> qr(M);
  return qr.householderQ() * MatrixXf::Identity(M.rows(), std::min(M.rows(), M.cols()));
}

/// The train in the gauge the fit works in: orthonormal U (n1 x r1) and V (n3 x r2), everything else in the
/// middle.
struct Gauge {
  MatrixXf U, V;
  MatrixXf middle;  // r1 x (n2 r2)
  auto slice(int j) const { return middle.middleCols(static_cast<Index>(j) * V.cols(), V.cols()); }
  auto slice(int j) { return middle.middleCols(static_cast<Index>(j) * V.cols(), V.cols()); }
};

Gauge toGauge(const TensorTrain& train) {
  Gauge g;
  g.U = orthonormalColumns(train.first());
  g.V = orthonormalColumns(train.last().transpose());
  const MatrixXf left = g.U.transpose() * train.first(), right = train.last() * g.V;
  const int n2 = train.modeSizes()[1];
  g.middle.resize(g.U.cols(), static_cast<Index>(n2) * g.V.cols());
  for (int j = 0; j < n2; ++j) g.slice(j) = left * train.slice(j) * right;
  return g;
}

constexpr float kRelaxation = 1.6f;  // over-relaxed completion; below 2 the weighted error still falls

/// One thread's working memory.
struct Buffers {
  MatrixXf values, weights, half, slab;
};

/// fn(begin, columns) for the columns of slab j, completed by the train: the samples where the weights say
/// so, the train elsewhere.
template <class Function>
void complete(const WeightedSlabSource& source, const Gauge& g, const MatrixXf& Vt, int j, Buffers& b,
              const Function& fn) {
  b.half.resize(g.U.rows(), g.V.cols());
  gemm(g.U, g.slice(j), b.half);
  overColumns(static_cast<int>(g.V.rows()), [&](int begin, int size) {
    b.values.resize(g.U.rows(), size);
    b.weights.resize(g.U.rows(), size);
    b.slab.resize(g.U.rows(), size);
    gemm(b.half, Vt.middleCols(begin, size), b.slab);
    source(j, begin, b.values, b.weights);
    b.slab.array() += kRelaxation * b.weights.array() * (b.values.array() - b.slab.array());
    fn(begin, b.slab);
  });
}

/// One orthogonal iteration on U and V, then the middle core by projection.
void sweep(const WeightedSlabSource& source, Gauge& g, int threads) {
  const Index n1 = g.U.rows(), n3 = g.V.rows(), r1 = g.U.cols(), r2 = g.V.cols();
  const int n2 = static_cast<int>(g.middle.cols() / r2);
  const MatrixXf Vt = g.V.transpose(), Ut = g.U.transpose();
  std::vector<MatrixXf> P(kSlabParts, MatrixXf::Zero(n1, r1)), Q(kSlabParts, MatrixXf::Zero(n3, r2));
  overParts(n2, kSlabParts, threads, [&](int part, int begin, int end) {
    Buffers b;
    MatrixXf share(n1, r2), product(n1, r2), transposed, small(r2, r1), p(n1, r1), x(r1, n3), xt,
        core(r1, r2), q(n3, r2);
    for (int j = begin; j < end; ++j) {
      product.setZero();
      complete(source, g, Vt, j, b, [&](int first, const MatrixXf& columns) {
        gemm(columns, g.V.middleRows(first, columns.cols()), share);
        product += share;                                        // Y_j = Z_j V
        gemm(Ut, columns, x.middleCols(first, columns.cols()));  // X_j = U^T Z_j
      });
      transposed = product.transpose();
      gemm(transposed, g.U, small);  // Y_j^T U
      gemm(product, small, p);       // Y_j Y_j^T U
      P[static_cast<std::size_t>(part)] += p;
      xt = x.transpose();
      gemm(x, g.V, core);  // X_j V
      gemm(xt, core, q);   // X_j^T X_j V
      Q[static_cast<std::size_t>(part)] += q;
    }
  });
  for (std::size_t part = 1; part < P.size(); ++part) {
    P[0] += P[part];
    Q[0] += Q[part];
  }
  Gauge next;
  next.U = orthonormalColumns(P[0]);
  next.V = orthonormalColumns(Q[0]);
  next.middle.resize(g.middle.rows(), g.middle.cols());
  const MatrixXf next_Ut = next.U.transpose();
  overParts(n2, kSlabParts, threads, [&](int, int begin, int end) {
    Buffers b;
    MatrixXf x(r1, n3), core(r1, r2);
    for (int j = begin; j < end; ++j) {
      complete(source, g, Vt, j, b, [&](int first, const MatrixXf& columns) {
        gemm(next_Ut, columns, x.middleCols(first, columns.cols()));
      });
      gemm(x, next.V, core);
      next.slice(j) = core;
    }
  });
  g = std::move(next);
}

}  // namespace

TensorTrain fitWeighted(const WeightedSlabSource& source, const TensorTrain& start,
                        const WeightedFitOptions& options) {
  Gauge g = toGauge(start);
  for (int n = 0; n < options.iterations; ++n) {
    sweep(source, g, std::max(1, options.threads));
    if (options.keep_going && !options.keep_going(static_cast<double>(n + 1) / options.iterations)) break;
  }
  return TensorTrain(start.axes(), g.U, g.middle, g.V.transpose());
}

TensorTrain fitWeighted(const DenseTensor& tensor, const std::vector<float>& weights,
                        const TensorTrain& start, const WeightedFitOptions& options) {
  const Slabs slabs = makeSlabs(tensor, weights, start);
  const WeightedSlabSource source = [&slabs](int j, int begin, Eigen::Ref<MatrixXf> slab_values,
                                             Eigen::Ref<MatrixXf> slab_weights) {
    slab_values = slabs.value(j).middleCols(begin, slab_values.cols());
    slab_weights = slabs.weight(j).middleCols(begin, slab_values.cols());
  };
  return fitWeighted(source, start, options);
}

double weightedRms(const DenseTensor& tensor, const std::vector<float>& weights, const TensorTrain& train) {
  const Slabs slabs = makeSlabs(tensor, weights, train);
  double squares = 0.0, total = 0.0;
  for (int j = 0; j < slabs.sizes[1]; ++j) {
    const MatrixXf slab = train.first() * train.slice(j) * train.last();
    squares += (slabs.weight(j).array() * (slabs.value(j) - slab).array().square()).cast<double>().sum();
    total += slabs.weight(j).cast<double>().sum();
  }
  return total > 0.0 ? std::sqrt(squares / total) : 0.0;
}

}  // namespace ttsdf
