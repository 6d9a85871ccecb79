#include "quantized_fit.h"

#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

#include "encoder/live_components.h"
#include "sparse_fitter.h"

namespace ttsdf {

namespace {

using Eigen::Index;
using Eigen::MatrixXf;

/// The decoded bases are nearly orthonormal and weights at most 1: steps below 2 do not overshoot, this one
/// with a margin for what the rounding of coarse bases adds.
constexpr float kStep = 1.0f;
/// As in the quantiser: what lies less above a whole number is worth no further step.
constexpr double kThreshold = 0.6;

}  // namespace

void fitQuantized(const WeightedSlabSource& source, QuantizedCores& cores,
                  const QuantizedFitOptions& options) {
  const TensorTrain train = dequantize(cores);
  TrainGauge gauge;
  gauge.axes = train.axes();
  gauge.U = train.first();
  gauge.V = train.last().transpose();
  gauge.M.resize(0, train.modeSizes()[1]);
  SparseFitter fitter(source, std::move(gauge), options.threads);
  MatrixXf values(static_cast<Index>(cores.middle.extents[0]) * cores.middle.extents[1],
                  cores.middle.extents[2]);
  std::vector<std::int32_t>& numbers = cores.middle.values;
  for (Index n = 0; n < values.size(); ++n)
    values.data()[n] = dequantizeNumber(numbers[static_cast<std::size_t>(n)], cores.step, cores.offsets);
  const MatrixXf support = (values.array() != 0.0f).cast<float>();
  MatrixXf open = support;  // 1: not rounded yet
  for (int part = 0; part < options.parts; ++part) {
    for (int n = 0; n < options.iterations; ++n) {
      values += kStep * open.cwiseProduct(fitter.missing(values));
      if (options.keep_going && !options.keep_going()) throw std::runtime_error("cancelled");
    }
    // Parts are mixed all over the core: every rounded number has open neighbours that make up for it.
    for (Index n = 0; n < values.size(); ++n) {
      const auto mixed = static_cast<std::uint32_t>(n) * 2654435761u >> 16;
      const bool last = part == options.parts - 1;
      if (open.data()[n] == 0.0f || (!last && static_cast<int>(mixed) % options.parts != part)) continue;
      std::int32_t& number = numbers[static_cast<std::size_t>(n)];
      number = quantizeNumber(values.data()[n], cores.step, kThreshold);
      values.data()[n] = dequantizeNumber(number, cores.step, cores.offsets);
      open.data()[n] = 0.0f;
    }
  }
  dropZeroComponents(cores);
}

}  // namespace ttsdf
