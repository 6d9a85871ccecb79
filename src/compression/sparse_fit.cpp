#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "../tensor/gemm.h"
#include "../tensor/slab_parts.h"
#include "dense_slabs.h"
#include "sparse_fitter.h"

namespace ttsdf {

namespace {

using Eigen::Index;
using Eigen::MatrixXf;

/// One thread's working memory.
struct FitBuffers {
  explicit FitBuffers(const TrainGauge& g)
      : half(g.U.rows(), g.V.cols()),
        share(g.U.rows(), g.V.cols()),
        back(g.U.rows(), g.V.cols()),
        slice(g.U.cols(), g.V.cols()) {}
  MatrixXf values, weights, slab, half, share, back, slice;
};

void shrink(MatrixXf& coefficients, const MatrixXf& factors, float threshold) {
  const auto signs = coefficients.array().sign();
  if (factors.size() == 0) {
    coefficients = signs * (coefficients.array().abs() - threshold).max(0.0f);
  } else {
    coefficients = signs * (coefficients.array().abs() - threshold * factors.array()).max(0.0f);
  }
}

void checkOptions(const SparseFitOptions& options) {
  if (std::isfinite(options.threshold) && options.threshold >= 0.0 && options.iterations >= 0 &&
      options.threads >= 1)
    return;
  std::ostringstream text;
  text << "fitSparse: got threshold " << options.threshold << " m, " << options.iterations << " iterations, "
       << options.threads << " threads, wanted threshold and iterations >= 0, threads >= 1";
  throw std::invalid_argument(text.str());
}

}  // namespace

SparseFitter::SparseFitter(const WeightedSlabSource& source, const TensorTrain& start, int threads)
    : source_(source),
      gauge_(principalGauge(orthonormalGauge(start))),
      cosines_(start.modeSizes()[1]),
      threads_(threads) {
  Ut_ = gauge_.U.transpose();
  Vt_ = gauge_.V.transpose();
  coefficients_ = cosines_.toFrequencies(gauge_.M, threads_);
  gauge_.M.resize(0, 0);
}

SparseFitter::SparseFitter(const WeightedSlabSource& source, TrainGauge bases, int threads)
    : source_(source),
      gauge_(std::move(bases)),
      cosines_(static_cast<int>(gauge_.M.cols())),
      threads_(threads) {
  Ut_ = gauge_.U.transpose();
  Vt_ = gauge_.V.transpose();
  gauge_.M.resize(0, 0);
}

/// What the weighted samples miss, projected on the bases: minus the gradient of the weighted half square
/// error. Slabs are independent, so the result does not depend on the number of threads.
MatrixXf SparseFitter::project(const MatrixXf& slices) const {
  MatrixXf projected(slices.rows(), slices.cols());
  const auto work = [&](int worker) {
    FitBuffers b(gauge_);
    for (int j = worker; j < static_cast<int>(slices.cols()); j += threads_) {
      gemm(gauge_.U, Eigen::Map<const MatrixXf>(slices.col(j).data(), gauge_.rank1(), gauge_.rank2()),
           b.half);
      b.back.setZero();
      overColumns(static_cast<int>(gauge_.V.rows()), [&](int begin, int size) {
        b.values.resize(gauge_.U.rows(), size);
        b.weights.resize(gauge_.U.rows(), size);
        b.slab.resize(gauge_.U.rows(), size);
        gemm(b.half, Vt_.middleCols(begin, size), b.slab);
        source_(j, begin, b.values, b.weights);
        b.slab = b.weights.cwiseProduct(b.values - b.slab);
        gemm(b.slab, gauge_.V.middleRows(begin, size), b.share);
        b.back += b.share;
      });
      gemm(Ut_, b.back, b.slice);
      projected.col(j) = Eigen::Map<const Eigen::VectorXf>(b.slice.data(), b.slice.size());
    }
  };
  std::vector<std::thread> workers;
  for (int worker = 1; worker < threads_; ++worker) workers.emplace_back(work, worker);
  work(0);
  for (std::thread& worker : workers) worker.join();
  return projected;
}

bool SparseFitter::run(double threshold, int iterations, const std::function<bool(double)>& keep_going) {
  MatrixXf ahead = coefficients_;
  double momentum = 1.0;
  for (int n = 0; n < iterations; ++n) {
    // The bases are orthonormal and the weights at most 1, so a gradient step of length 1 never overshoots.
    MatrixXf next = ahead + missing(ahead);
    shrink(next, factors_, static_cast<float>(threshold));
    const bool uphill = (ahead - next).cwiseProduct(next - coefficients_).sum() > 0.0f;
    const double next_momentum = uphill ? 1.0 : 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * momentum * momentum));
    const auto carry = static_cast<float>(uphill ? 0.0 : (momentum - 1.0) / next_momentum);
    ahead = next + carry * (next - coefficients_);
    coefficients_ = std::move(next);
    momentum = next_momentum;
    if (keep_going && !keep_going((n + 1.0) / iterations)) return false;
  }
  return true;
}

void SparseFitter::reweight(double threshold) {
  // What will be kept is fitted without the penalty from here on: shrinking would pull surfaces to one side.
  constexpr float kStandsOut = 4.0f;  // thresholds; what the quantiser keeps
  const auto limit = kStandsOut * static_cast<float>(threshold);
  factors_ = (coefficients_.array().abs() > limit)
                 .select(MatrixXf::Constant(coefficients_.rows(), coefficients_.cols(), 0.0f), 2.0f);
}

TensorTrain SparseFitter::train() const {
  const MatrixXf slices = cosines_.fromFrequencies(coefficients_, threads_);
  const Index columns = static_cast<Index>(gauge_.rank2()) * slices.cols();
  return TensorTrain(gauge_.axes, gauge_.U,
                     Eigen::Map<const MatrixXf>(slices.data(), gauge_.rank1(), columns), Vt_);
}

TensorTrain fitSparse(const WeightedSlabSource& source, const TensorTrain& start,
                      const SparseFitOptions& options) {
  checkOptions(options);
  SparseFitter fitter(source, start, options.threads);
  const int reweighted = options.iterations / 3;
  const auto progress = [&](double begin, double size) {
    return [&options, begin, size](double share) {
      return !options.keep_going || options.keep_going(begin + size * share);
    };
  };
  if (fitter.run(options.threshold, options.iterations - reweighted, progress(0.0, 2.0 / 3.0))) {
    fitter.reweight(options.threshold);
    fitter.run(options.threshold, reweighted, progress(2.0 / 3.0, 1.0 / 3.0));
  }
  return fitter.train();
}

TensorTrain fitSparse(const DenseTensor& tensor, const std::vector<float>& weights, const TensorTrain& start,
                      const SparseFitOptions& options) {
  return fitSparse(denseSlabs(tensor, weights, start, "fitSparse"), start, options);
}

}  // namespace ttsdf
