#include "core_quantizer.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "../../map/codec/coefficients/cosine_transform.h"
#include "core_writer.h"
#include "live_components.h"

namespace ttsdf {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;

/// Chosen by bytes at equal error near the surface on maps of real rooms.
constexpr double kMiddleThreshold = 0.72;
constexpr double kBasisThreshold = 0.6;

/// Column c of U or V is multiplied by a slice of the middle core of norm norms[c]: with the step divided by
/// that norm its error in the full array is like that of the middle core.
QuantizedBasis quantizeBasis(const MatrixXf& basis, const Eigen::VectorXd& norms, double step) {
  QuantizedBasis result;
  const double largest = std::max(norms.maxCoeff(), 1e-30);
  result.finest_step = static_cast<float>(std::clamp(step / largest, 1e-30, 1e30));
  for (Index n = 0; n < norms.size(); ++n) {
    const double quarters = std::round(4.0 * std::log2(largest / std::max(norms[n], 1e-30)));
    result.coarseness.push_back(static_cast<std::uint8_t>(std::clamp(quarters, 0.0, 255.0)));
  }
  const MatrixXf frequencies = rowsToFrequencies(basis.transpose());
  result.values = CoefficientBlock(static_cast<int>(basis.rows()), static_cast<int>(basis.cols()), 1);
  OffsetMean mean;
  std::size_t n = 0;
  for (Index c = 0; c < basis.cols(); ++c) {
    const double column_step = result.step(c);
    for (Index i = 0; i < basis.rows(); ++i, ++n) {
      const double value = frequencies(c, i);
      mean.add(result.values.values[n] = quantizeNumber(value, column_step, kBasisThreshold), value,
               column_step);
    }
  }
  result.offsets = mean.offsets();
  return result;
}

/// The matrix that carries coordinates in `basis` (orthonormal) over to `decoded` with least error.
MatrixXf refitMatrix(const MatrixXf& decoded, const MatrixXf& basis) {
  const MatrixXd D = decoded.cast<double>();
  const Index n = D.cols();
  // The small ridge keeps columns apart that quantisation made alike.
  const MatrixXd gram = D.transpose() * D + 1e-6 * MatrixXd::Identity(n, n);
  return gram.llt().solve(D.transpose() * basis.cast<double>()).cast<float>();
}

std::size_t sizeOf(const QuantizedCores& cores) {
  ByteWriter out;
  writeQuantized(cores, out);
  return out.size();
}

/// The factor on the step that brings a section from `size` to `wanted` bytes: few bits per coefficient and
/// the size falls about as step^-1.1; many, and each octave of the step takes one bit from every coefficient.
double stepFactor(std::size_t size, std::size_t wanted, const QuantizedCores& cores) {
  const double ratio = static_cast<double>(size) / static_cast<double>(wanted);
  const auto& values = cores.middle.values;
  const auto nonzero =
      static_cast<double>(values.size()) - static_cast<double>(std::count(values.begin(), values.end(), 0));
  if (nonzero < 0.5 * static_cast<double>(values.size())) return std::clamp(std::pow(ratio, 0.9), 0.1, 10.0);
  const double bits = 8.0 * (static_cast<double>(size) - static_cast<double>(wanted)) / nonzero;
  return std::exp2(std::clamp(bits, -4.0, 4.0));
}

}  // namespace

CoreQuantizer::CoreQuantizer(const TensorTrain& train) : gauge_(orthonormalGauge(train)) {
  // A train fitted to be sparse (fitSparse) is best left as it is; any other gains by being turned.
  TrainGauge turned = principalGauge(gauge_);
  const auto cost = [](const TrainGauge& gauge) {
    return rowsToFrequencies(gauge.M).cast<double>().cwiseAbs().sum();
  };
  if (cost(turned) < cost(gauge_)) gauge_ = std::move(turned);
  entries_ = static_cast<double>(gauge_.U.rows()) * static_cast<double>(gauge_.M.cols()) *
             static_cast<double>(gauge_.V.rows());
}

double CoreQuantizer::stepForRms(double rms) const {
  const auto coefficients = static_cast<double>(gauge_.U.size() + gauge_.M.size() + gauge_.V.size());
  return rms * std::sqrt(12.0 * entries_ / coefficients);
}

QuantizedCores CoreQuantizer::toStep(double step) const {
  QuantizedCores cores;
  cores.header.encoding = Encoding::kQuantized;
  cores.header.axes = gauge_.axes;
  cores.header.sizes = {{static_cast<int>(gauge_.U.rows()), static_cast<int>(gauge_.M.cols()),
                         static_cast<int>(gauge_.V.rows())}};
  cores.step = static_cast<float>(std::clamp(step, 1e-30, 1e30));
  cores.first = quantizeBasis(gauge_.U, sliceNorms1(gauge_.M, gauge_.rank1()), cores.step);
  cores.last = quantizeBasis(gauge_.V, sliceNorms2(gauge_.M, gauge_.rank1()), cores.step);
  dropZeroColumns(cores.first, cores.last);
  // The middle core is fitted to what the decoder will see of the bases.
  const MatrixXf fitted = changeBasis(refitMatrix(cores.first.decoded(), gauge_.U), gauge_.M,
                                      refitMatrix(cores.last.decoded(), gauge_.V));
  const MatrixXf frequencies = rowsToFrequencies(fitted);
  cores.middle = CoefficientBlock(cores.first.values.extents[1], cores.last.values.extents[1],
                                  static_cast<int>(frequencies.cols()));
  OffsetMean mean;
  for (Index n = 0; n < frequencies.size(); ++n) {
    const double value = frequencies.data()[n];
    std::int32_t& q = cores.middle.values[static_cast<std::size_t>(n)];
    mean.add(q = quantizeNumber(value, cores.step, kMiddleThreshold), value, cores.step);
  }
  cores.offsets = mean.offsets();
  dropZeroComponents(cores);
  return cores;
}

double CoreQuantizer::errorRms(const QuantizedCores& cores) const {
  const MatrixXf U = cores.first.decoded(), V = cores.last.decoded(), M = cores.decodedMiddle();
  // Inside the span of the exact bases the two middle cores are compared directly; what the decoded bases
  // have outside of it adds to the error. No difference of large numbers, so small errors are exact too.
  const MatrixXf Bu = gauge_.U.transpose() * U, Bv = gauge_.V.transpose() * V;
  const double inside = (changeBasis(Bu, M, Bv) - gauge_.M).cast<double>().squaredNorm();
  const MatrixXd Du = U.cast<double>() - gauge_.U.cast<double>() * Bu.cast<double>();
  const MatrixXd Dv = V.cast<double>() - gauge_.V.cast<double>() * Bv.cast<double>();
  const MatrixXf outside_u = (Du.transpose() * Du).cast<float>(),
                 outside_v = (Dv.transpose() * Dv).cast<float>();
  const MatrixXf gram_v = V.transpose() * V, inner_u = Bu.transpose() * Bu;
  const auto product = [&](const MatrixXf& A, const MatrixXf& B) {
    return changeBasis(A, M, B).cast<double>().cwiseProduct(M.cast<double>()).sum();
  };
  const double outside = product(outside_u, gram_v) + product(inner_u, outside_v);
  return std::sqrt(std::max(inside + outside, 0.0) / entries_);
}

QuantizedCores CoreQuantizer::toRms(double rms) const {
  // Coefficients below the step bring less error than the formula says, so the step may grow beyond it.
  double step = stepForRms(rms), kept = 0.0, exceeded = 0.0;
  QuantizedCores best;
  for (int n = 0; n < 40; ++n) {
    QuantizedCores cores = toStep(step);
    const double share = errorRms(cores) / rms;
    if (share <= 1.0) {
      best = std::move(cores);
      kept = step;
      if (share > 0.97) break;
    } else {
      exceeded = step;
    }
    if (kept > 0.0 && (n > 10 || (exceeded > 0.0 && exceeded < 1.01 * kept))) break;
    double next = step * std::clamp(std::pow(0.985 / std::max(share, 1e-3), 1.3), 0.1, 10.0);
    if (kept > 0.0 && exceeded > 0.0 && (next <= kept || next >= exceeded)) next = std::sqrt(kept * exceeded);
    step = next;
  }
  // Floating point itself leaves an error; nothing below it can be promised.
  return kept > 0.0 ? best : toStep(step);
}

QuantizedCores CoreQuantizer::toBytes(std::size_t bytes) const {
  const double field_rms = std::sqrt(gauge_.M.cast<double>().squaredNorm() / entries_);
  if (field_rms == 0.0) return toStep(1.0);
  double step = stepForRms(0.01 * field_rms), fits = 0.0, exceeds = 0.0;
  QuantizedCores best;
  for (int n = 0; n < 40; ++n) {
    QuantizedCores cores = toStep(step);
    const std::size_t size = sizeOf(cores);
    const double factor = stepFactor(size, bytes, cores);
    if (size <= bytes) {
      best = std::move(cores);
      fits = step;
      if (static_cast<double>(size) > 0.985 * static_cast<double>(bytes)) break;
    } else {
      exceeds = step;
    }
    const bool everything_fits = exceeds == 0.0 && step < stepForRms(1e-6 * field_rms);
    if (everything_fits || (fits > 0.0 && exceeds > 0.0 && fits < 1.003 * exceeds)) break;
    double next = step * factor * 1.005;
    if (fits > 0.0 && exceeds > 0.0 && (next <= exceeds || next >= fits)) next = std::sqrt(exceeds * fits);
    step = next;
  }
  if (fits == 0.0)
    throw std::runtime_error("quantisation: found no step for " + std::to_string(bytes) + " bytes");
  return best;
}

}  // namespace ttsdf
