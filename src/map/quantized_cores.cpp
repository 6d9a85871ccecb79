#include "quantized_cores.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "cosine_transform.h"

namespace ttsdf {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;

/// A magnitude q covers [q - 1 + threshold, q + threshold) steps: the dead zone around zero is wider than a
/// rounding quantiser's, because most of what lies just above half a step costs more bits than it is worth.
constexpr double kMiddleThreshold = 0.72;
constexpr double kBasisThreshold = 0.6;
/// Bases are quantised more finely than an equal share of the error asks for: their error hits every slice.
constexpr double kBasisFineness = 1.0;

double stepOf(double step, int fineness) {
  constexpr double kQuarters[4] = {1.0, 0.8408964152537145, 0.7071067811865476, 0.5946035575013605};
  return std::ldexp(step * kQuarters[fineness % 4], -(fineness / 4));
}

std::int32_t quantizeOne(double value, double step, double threshold) {
  const double magnitude = std::floor(std::abs(value) / step + 1.0 - threshold);
  const auto q = static_cast<std::int32_t>(std::min(magnitude, static_cast<double>(kMaxCoefficient)));
  return value < 0.0 ? -q : q;
}

float dequantizeOne(std::int32_t q, double step, const std::array<std::int8_t, 2>& offsets) {
  if (q == 0) return 0.0f;
  const int magnitude = std::abs(q);
  const double value = step * (magnitude + offsets[magnitude > 1 ? 1 : 0] / 128.0);
  return static_cast<float>(q < 0 ? -value : value);
}

/// Collects where the values of a magnitude really lie; their mean is the best place to put them back.
class OffsetMean {
 public:
  void add(std::int32_t q, double value, double step) {
    if (q == 0) return;
    const std::size_t k = std::abs(q) > 1 ? 1 : 0;
    sum_[k] += std::abs(value) / step - std::abs(q);
    ++count_[k];
  }
  std::array<std::int8_t, 2> offsets() const {
    std::array<std::int8_t, 2> result{};
    for (std::size_t k = 0; k < 2; ++k) {
      if (count_[k] > 0) {
        const double scaled = std::round(128.0 * sum_[k] / static_cast<double>(count_[k]));
        result[k] = static_cast<std::int8_t>(std::clamp(scaled, -127.0, 127.0));
      }
    }
    return result;
  }

 private:
  std::array<double, 2> sum_{};
  std::array<std::size_t, 2> count_{};
};

/// Quantises the frequencies of the columns of U or V; column c has its own step.
CoefficientBlock quantizeBasis(const MatrixXf& frequencies, const std::vector<std::uint8_t>& fineness,
                               double step, OffsetMean& mean) {
  CoefficientBlock block(static_cast<int>(frequencies.rows()), static_cast<int>(frequencies.cols()), 1);
  std::size_t n = 0;
  for (Index c = 0; c < frequencies.cols(); ++c) {
    const double column_step = stepOf(step, fineness[static_cast<std::size_t>(c)]);
    for (Index i = 0; i < frequencies.rows(); ++i, ++n) {
      block.values[n] = quantizeOne(frequencies(i, c), column_step, kBasisThreshold);
      mean.add(block.values[n], frequencies(i, c), column_step);
    }
  }
  return block;
}

MatrixXf dequantizeBasis(const CoefficientBlock& block, const std::vector<std::uint8_t>& fineness,
                         double step, const std::array<std::int8_t, 2>& offsets) {
  MatrixXf frequencies(block.extents[0], block.extents[1]);
  std::size_t n = 0;
  for (Index c = 0; c < frequencies.cols(); ++c) {
    const double column_step = stepOf(step, fineness[static_cast<std::size_t>(c)]);
    for (Index i = 0; i < frequencies.rows(); ++i, ++n) {
      frequencies(i, c) = dequantizeOne(block.values[n], column_step, offsets);
    }
  }
  return rowsFromFrequencies(frequencies.transpose()).transpose();
}

MatrixXf dequantizeMiddle(const QuantizedCores& cores) {
  const CoefficientBlock& block = cores.middle;
  MatrixXf frequencies(static_cast<Index>(block.extents[0]) * block.extents[1], block.extents[2]);
  for (Index n = 0; n < frequencies.size(); ++n) {
    frequencies.data()[n] =
        dequantizeOne(block.values[static_cast<std::size_t>(n)], cores.step, cores.offsets[0]);
  }
  return rowsFromFrequencies(frequencies);
}

std::vector<std::uint8_t> finenessOf(const Eigen::VectorXd& norms) {
  std::vector<std::uint8_t> fineness;
  for (const double norm : norms) {
    const double quarters = std::round(4.0 * std::log2(std::max(norm * kBasisFineness, 1e-30)));
    fineness.push_back(static_cast<std::uint8_t>(std::clamp(quarters, 0.0, 255.0)));
  }
  return fineness;
}

/// Columns of U (or V) and slices of the middle core that still carry anything; never none.
std::vector<int> liveColumns(const CoefficientBlock& basis, const CoefficientBlock* middle,
                             std::size_t axis) {
  const int columns = basis.extents[1];
  std::vector<char> alive(static_cast<std::size_t>(columns), 0);
  for (std::size_t n = 0; n < basis.values.size(); ++n) {
    if (basis.values[n] != 0) alive[n / static_cast<std::size_t>(basis.extents[0])] = 1;
  }
  if (middle != nullptr) {
    std::vector<char> used(alive.size(), 0);
    const auto r1 = static_cast<std::size_t>(middle->extents[0]),
               r2 = static_cast<std::size_t>(middle->extents[1]);
    for (std::size_t n = 0; n < middle->values.size(); ++n) {
      if (middle->values[n] != 0) used[axis == 0 ? n % r1 : n / r1 % r2] = 1;
    }
    for (std::size_t c = 0; c < alive.size(); ++c) alive[c] = alive[c] && used[c];
  }
  std::vector<int> live;
  for (int c = 0; c < columns; ++c) {
    if (alive[static_cast<std::size_t>(c)]) live.push_back(c);
  }
  if (live.empty()) live.push_back(0);
  return live;
}

CoefficientBlock keepColumns(const CoefficientBlock& block, const std::vector<int>& columns) {
  CoefficientBlock kept(block.extents[0], static_cast<int>(columns.size()), 1);
  const auto rows = static_cast<std::ptrdiff_t>(block.extents[0]);
  auto out = kept.values.begin();
  for (const int c : columns) out = std::copy_n(block.values.begin() + rows * c, rows, out);
  return kept;
}

CoefficientBlock keepSlices(const CoefficientBlock& block, const std::vector<int>& first,
                            const std::vector<int>& last) {
  CoefficientBlock kept(static_cast<int>(first.size()), static_cast<int>(last.size()), block.extents[2]);
  const auto r1 = static_cast<std::size_t>(block.extents[0]), r2 = static_cast<std::size_t>(block.extents[1]);
  std::size_t n = 0;
  for (std::size_t f = 0; f < static_cast<std::size_t>(block.extents[2]); ++f) {
    for (const int b : last) {
      for (const int a : first) {
        kept.values[n++] =
            block.values[static_cast<std::size_t>(a) + r1 * (static_cast<std::size_t>(b) + r2 * f)];
      }
    }
  }
  return kept;
}

template <typename T>
std::vector<T> keep(const std::vector<T>& values, const std::vector<int>& which) {
  std::vector<T> kept;
  for (const int n : which) kept.push_back(values[static_cast<std::size_t>(n)]);
  return kept;
}

void dropDeadComponents(QuantizedCores& cores) {
  for (bool changed = true; changed;) {
    const std::vector<int> live1 = liveColumns(cores.first, &cores.middle, 0);
    const std::vector<int> live2 = liveColumns(cores.last, &cores.middle, 1);
    changed = live1.size() < cores.fineness1.size() || live2.size() < cores.fineness2.size();
    if (!changed) break;
    cores.first = keepColumns(cores.first, live1);
    cores.last = keepColumns(cores.last, live2);
    cores.middle = keepSlices(cores.middle, live1, live2);
    cores.fineness1 = keep(cores.fineness1, live1);
    cores.fineness2 = keep(cores.fineness2, live2);
  }
  cores.header.rank1 = cores.first.extents[1];
  cores.header.rank2 = cores.last.extents[1];
}

/// The matrix that carries coordinates in `basis` (orthonormal) over to `decoded` with least error.
MatrixXf refitMatrix(const MatrixXf& decoded, const MatrixXf& basis) {
  const MatrixXd D = decoded.cast<double>();
  const Index n = D.cols();
  // The small ridge keeps columns apart that quantisation made alike.
  const MatrixXd gram = D.transpose() * D + 1e-6 * MatrixXd::Identity(n, n);
  return gram.llt().solve(D.transpose() * basis.cast<double>()).cast<float>();
}

}  // namespace

QuantizedEncoder::QuantizedEncoder(const TensorTrain& train) : gauge_(orthonormalGauge(train)) {
  // A train fitted to be sparse (fitSparse) is best left as it is; any other gains by being turned.
  TrainGauge turned = principalGauge(gauge_);
  const auto bits = [](const TrainGauge& gauge) {
    return rowsToFrequencies(gauge.M).cast<double>().cwiseAbs().sum();
  };
  if (bits(turned) < bits(gauge_)) gauge_ = std::move(turned);
  entries_ = static_cast<double>(gauge_.U.rows()) * static_cast<double>(gauge_.M.cols()) *
             static_cast<double>(gauge_.V.rows());
}

double QuantizedEncoder::stepForRms(double rms) const {
  const auto coefficients = static_cast<double>(gauge_.U.size() + gauge_.M.size() + gauge_.V.size());
  return rms * std::sqrt(12.0 * entries_ / coefficients);
}

QuantizedCores QuantizedEncoder::quantize(double step) const {
  QuantizedCores cores;
  cores.header.encoding = Encoding::kQuantized;
  cores.header.axes = gauge_.axes;
  cores.header.sizes = {{static_cast<int>(gauge_.U.rows()), static_cast<int>(gauge_.M.cols()),
                         static_cast<int>(gauge_.V.rows())}};
  cores.step = static_cast<float>(step);
  // Bases first: the middle core is then fitted to what the decoder will see of them.
  OffsetMean basis_mean, middle_mean;
  cores.fineness1 = finenessOf(sliceNorms1(gauge_.M, gauge_.rank1()));
  cores.fineness2 = finenessOf(sliceNorms2(gauge_.M, gauge_.rank1()));
  cores.first = quantizeBasis(rowsToFrequencies(gauge_.U.transpose()).transpose(), cores.fineness1,
                              cores.step, basis_mean);
  cores.last = quantizeBasis(rowsToFrequencies(gauge_.V.transpose()).transpose(), cores.fineness2, cores.step,
                             basis_mean);
  cores.offsets[1] = basis_mean.offsets();
  const std::vector<int> live1 = liveColumns(cores.first, nullptr, 0),
                         live2 = liveColumns(cores.last, nullptr, 1);
  cores.first = keepColumns(cores.first, live1);
  cores.last = keepColumns(cores.last, live2);
  cores.fineness1 = keep(cores.fineness1, live1);
  cores.fineness2 = keep(cores.fineness2, live2);
  const MatrixXf U = dequantizeBasis(cores.first, cores.fineness1, cores.step, cores.offsets[1]);
  const MatrixXf V = dequantizeBasis(cores.last, cores.fineness2, cores.step, cores.offsets[1]);
  const MatrixXf fitted = changeBasis(refitMatrix(U, gauge_.U), gauge_.M, refitMatrix(V, gauge_.V));

  const MatrixXf frequencies = rowsToFrequencies(fitted);
  cores.middle = CoefficientBlock(static_cast<int>(live1.size()), static_cast<int>(live2.size()),
                                  static_cast<int>(frequencies.cols()));
  for (Index n = 0; n < frequencies.size(); ++n) {
    std::int32_t& q = cores.middle.values[static_cast<std::size_t>(n)];
    q = quantizeOne(frequencies.data()[n], cores.step, kMiddleThreshold);
    middle_mean.add(q, frequencies.data()[n], cores.step);
  }
  cores.offsets[0] = middle_mean.offsets();
  dropDeadComponents(cores);
  return cores;
}

double QuantizedEncoder::errorRms(const QuantizedCores& cores) const {
  const MatrixXf U = dequantizeBasis(cores.first, cores.fineness1, cores.step, cores.offsets[1]);
  const MatrixXf V = dequantizeBasis(cores.last, cores.fineness2, cores.step, cores.offsets[1]);
  const MatrixXf M = dequantizeMiddle(cores);
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

QuantizedCores QuantizedEncoder::quantizeToRms(double rms) const {
  double step = stepForRms(rms);
  QuantizedCores cores = quantize(step);
  double error = errorRms(cores);
  // Coefficients below the step bring less error than the formula says, so the step may grow.
  for (int n = 0; n < 8 && (error > rms || error < 0.97 * rms); ++n) {
    step *= std::clamp(std::pow(0.99 * rms / std::max(error, 1e-3 * rms), 1.2), 0.2, 4.0);
    QuantizedCores next = quantize(step);
    const double next_error = errorRms(next);
    if (next_error > rms && error <= rms && next_error > 1.5 * rms) continue;
    cores = std::move(next);
    error = next_error;
  }
  while (error > rms && step > 1e-9 * stepForRms(rms)) {
    step *= 0.7;
    cores = quantize(step);
    error = errorRms(cores);
  }
  return cores;
}

QuantizedCores QuantizedEncoder::quantizeToBytes(std::size_t bytes) const {
  const auto sizeOf = [](const QuantizedCores& cores) {
    ByteWriter out;
    writeQuantized(cores, out);
    return out.size();
  };
  // Steps that give too much and little enough; the size falls about as step^-1.1.
  double fine = 0.0,
         step = stepForRms(1e-3 * std::sqrt(gauge_.M.cast<double>().squaredNorm() / entries_) + 1e-30);
  QuantizedCores best;
  double best_step = 0.0;
  for (int n = 0; n < 40; ++n) {
    QuantizedCores cores = quantize(step);
    const std::size_t size = sizeOf(cores);
    const double ratio = static_cast<double>(size) / static_cast<double>(bytes);
    if (size <= bytes) {
      best = std::move(cores);
      best_step = step;
      if (ratio > 0.985) break;
    } else {
      fine = step;
    }
    const bool bracketed = fine > 0.0 && best_step > 0.0;
    if (bracketed && best_step < 1.003 * fine) break;
    if (best_step > 0.0 && fine == 0.0 && n > 8) break;  // everything fits, however fine
    step *= std::clamp(std::pow(ratio * 1.005, 0.9), 0.1, 10.0);
    if (bracketed && (step <= fine || step >= best_step)) step = std::sqrt(fine * best_step);
  }
  if (best_step == 0.0)
    throw std::runtime_error("quantisation: no step gives " + std::to_string(bytes) + " bytes");
  return best;
}

void writeQuantized(const QuantizedCores& cores, ByteWriter& out) {
  writeCoreHeader(cores.header, out);
  out.f32(cores.step);
  for (const auto& offsets : cores.offsets) {
    for (const std::int8_t offset : offsets) out.u8(static_cast<std::uint8_t>(offset));
  }
  for (const auto* fineness : {&cores.fineness1, &cores.fineness2}) {
    for (const std::uint8_t f : *fineness) out.u8(f);
  }
  writeCoefficients({cores.first, cores.middle, cores.last}, out);
}

QuantizedCores readQuantized(ByteReader& in, const CoreHeader& header) {
  QuantizedCores cores;
  cores.header = header;
  cores.step = in.f32();
  if (!std::isfinite(cores.step) || cores.step <= 0.0f) {
    refuse(in.what() + ": quantisation step", std::to_string(cores.step), "a positive number");
  }
  for (auto& offsets : cores.offsets) {
    for (std::int8_t& offset : offsets) offset = static_cast<std::int8_t>(in.u8());
  }
  const auto readFineness = [&](int rank) {
    const std::uint8_t* const bytes = in.take(static_cast<std::size_t>(rank));
    return std::vector<std::uint8_t>(bytes, bytes + rank);
  };
  cores.fineness1 = readFineness(header.rank1);
  cores.fineness2 = readFineness(header.rank2);
  std::vector<CoefficientBlock> blocks = {CoefficientBlock(header.sizes[0], header.rank1, 1),
                                          CoefficientBlock(header.rank1, header.rank2, header.sizes[1]),
                                          CoefficientBlock(header.sizes[2], header.rank2, 1)};
  readCoefficients(in, blocks);
  in.expectEnd();
  cores.first = std::move(blocks[0]);
  cores.middle = std::move(blocks[1]);
  cores.last = std::move(blocks[2]);
  return cores;
}

TensorTrain dequantize(const QuantizedCores& cores) {
  MatrixXf first = dequantizeBasis(cores.first, cores.fineness1, cores.step, cores.offsets[1]);
  MatrixXf last = dequantizeBasis(cores.last, cores.fineness2, cores.step, cores.offsets[1]).transpose();
  const MatrixXf slices = dequantizeMiddle(cores);  // (r1 r2) x n2: the same memory as r1 x (n2 r2)
  MatrixXf middle = Eigen::Map<const MatrixXf>(slices.data(), cores.header.rank1,
                                               static_cast<Index>(cores.header.rank2) * slices.cols());
  return TensorTrain(cores.header.axes, std::move(first), std::move(middle), std::move(last));
}

}  // namespace ttsdf
