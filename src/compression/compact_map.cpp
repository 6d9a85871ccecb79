#include "ttsdf_localization/compression/compact_map.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dense_slabs.h"
#include "encoder/core_quantizer.h"
#include "encoder/map_bytes.h"
#include "quantized_fit.h"
#include "sparse_fitter.h"
#include "ttsdf_localization/compression/map_writer.h"

namespace ttsdf {

namespace {

/// A step of so many thresholds loses little of what the fit kept.
constexpr double kStepPerThreshold = 8.0;
constexpr int kMostTrials = 8;
constexpr double kCloseEnough = 0.02;  // of the logarithm of a size

void checkOptions(const CompactOptions& options) {
  const auto fail = [](const std::string& got, const std::string& wanted) {
    throw std::invalid_argument("compactMap: got " + got + ", wanted " + wanted);
  };
  if (!(options.threshold > 0.0) || !std::isfinite(options.threshold))
    fail("threshold " + std::to_string(options.threshold) + " m", "a positive distance");
  if (!(options.target_error >= 0.0)) fail("target_error " + std::to_string(options.target_error), ">= 0");
  if (options.target_error > 0.0 && !options.error) fail("target_error without a measure", "one");
  if (options.iterations < 1) fail(std::to_string(options.iterations) + " iterations", ">= 1");
  if (options.threads < 1) fail(std::to_string(options.threads) + " threads", ">= 1");
}

/// One threshold, fitted and encoded.
struct Trial {
  double threshold = 0.0;
  TensorTrain train;
  std::vector<std::uint8_t> bytes;
  double error = 0.0;
};

class Search {
 public:
  Search(const TtSdfMap& map, const WeightedSlabSource& source, const CompactOptions& options)
      : map_(map), source_(source), options_(options), fitter_(source, map.train, options.threads) {}

  Trial run() {
    Trial trial = attempt(options_.threshold);
    if (options_.target_error > 0.0) trial = meetError(std::move(trial));
    const bool too_large = options_.target_bytes > 0 && trial.bytes.size() > options_.target_bytes;
    const bool room_left = options_.target_bytes > 0 && options_.target_error == 0.0;
    if (too_large || room_left) trial = meetBytes(std::move(trial));
    return trial;
  }

 private:
  Trial attempt(double threshold) {
    const int reweighted = options_.iterations / 3;
    Trial trial;
    trial.threshold = threshold;
    fitter_.forgetWeights();
    fit(threshold, options_.iterations - reweighted);
    fitter_.reweight(threshold);
    fit(threshold, reweighted);
    trial.train = fitter_.train();
    trial.bytes = encoded(trial.train, kStepPerThreshold * threshold);
    if (options_.target_error > 0.0) {
      trial.error = options_.error(deserialize(trial.bytes.data(), trial.bytes.size()).train);
    }
    return trial;
  }

  void fit(double threshold, int iterations) {
    const bool finished = fitter_.run(threshold, iterations, [this](double) { return goesOn(); });
    if (!finished) throw std::runtime_error("cancelled");
  }

  /// The coarsest trial that keeps the error, or the most exact one.
  Trial meetError(Trial trial) {
    Trial best = trial;
    double fine = 0.0, coarse = 0.0;  // thresholds that keep the error and that do not
    double slope = 0.5;               // of log error over log threshold
    for (int n = 1;; ++n) {
      const double share = trial.error / options_.target_error;
      const bool kept = share <= 1.0;
      const bool better = best.error > options_.target_error ? trial.error < best.error
                                                             : kept && trial.threshold > best.threshold;
      if (better) best = trial;
      (kept ? fine : coarse) = trial.threshold;
      if ((kept && share > 0.97) || n == kMostTrials) return best;
      double next = trial.threshold * std::exp(std::clamp(std::log(0.985 / share) / slope, -2.5, 2.5));
      if (fine > 0.0 && coarse > 0.0 && (next <= fine || next >= coarse)) next = std::sqrt(fine * coarse);
      Trial after = attempt(next);
      slope = std::log(after.error / trial.error) / std::log(after.threshold / trial.threshold);
      slope = std::isfinite(slope) ? std::clamp(slope, 0.1, 1.0) : 0.5;
      trial = std::move(after);
    }
  }

  /// A threshold whose file comes near the target; the quantisation then meets it.
  Trial meetBytes(Trial trial) {
    const auto excess = [this](const std::vector<std::uint8_t>& bytes) {
      return std::log(static_cast<double>(bytes.size()) / static_cast<double>(options_.target_bytes));
    };
    for (int n = 1; n < kMostTrials && std::abs(excess(trial.bytes)) > 0.08; ++n) {
      trial = attempt(trial.threshold * std::exp(std::clamp(0.9 * excess(trial.bytes), -2.0, 2.0)));
    }
    // The same fit at other steps: the largest file that fits.
    const std::vector<std::uint8_t> fitted = std::move(trial.bytes);
    double step = kStepPerThreshold * trial.threshold, distance = excess(fitted);
    trial.bytes.clear();
    for (int n = 0; n < kMostTrials; ++n) {
      std::vector<std::uint8_t> bytes = n == 0 ? fitted : encoded(trial.train, step);
      distance = excess(bytes);
      const bool fits = distance <= 0.0;
      if (fits && bytes.size() > trial.bytes.size()) trial.bytes = std::move(bytes);
      if (fits && distance > -kCloseEnough) return trial;
      step *= std::exp(std::clamp(0.8 * (distance + 0.4 * kCloseEnough), -1.0, 1.0));
    }
    if (!trial.bytes.empty() && excess(trial.bytes) > -2.0 * kCloseEnough) return trial;
    // Steps that leap over the target: the quantiser alone finds one that does not.
    EncodeOptions encode;
    encode.encoding = Encoding::kQuantized;
    encode.target_bytes = options_.target_bytes;
    TtSdfMap map = map_;
    map.train = trial.train;
    std::vector<std::uint8_t> plain = serialize(map, encode);
    if (plain.size() > trial.bytes.size()) trial.bytes = std::move(plain);
    return trial;
  }

  std::vector<std::uint8_t> encoded(const TensorTrain& train, double step) {
    QuantizedCores cores = CoreQuantizer(train).toStep(step);
    QuantizedFitOptions fit;
    fit.threads = options_.threads;
    fit.keep_going = [this] { return goesOn(); };
    fitQuantized(source_, cores, fit);
    return serializeQuantized(map_, cores);
  }

  bool goesOn() {
    ++done_;
    const double expected = 3.0 * options_.iterations;
    return !options_.keep_going || options_.keep_going(done_ / (done_ + expected));
  }

  const TtSdfMap& map_;
  const WeightedSlabSource& source_;
  const CompactOptions& options_;
  SparseFitter fitter_;
  double done_ = 0.0;
};

}  // namespace

CompactMap compactMap(const TtSdfMap& map, const WeightedSlabSource& source, const CompactOptions& options) {
  check(map);
  checkOptions(options);
  Trial trial = Search(map, source, options).run();
  CompactMap result;
  result.map = deserialize(trial.bytes.data(), trial.bytes.size());
  result.bytes = std::move(trial.bytes);
  result.threshold = trial.threshold;
  return result;
}

CompactMap compactMap(const TtSdfMap& map, const DenseTensor& values, const std::vector<float>& weights,
                      const CompactOptions& options) {
  check(map);
  return compactMap(map, denseSlabs(values, weights, map.train, "compactMap"), options);
}

}  // namespace ttsdf
