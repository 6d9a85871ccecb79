#pragma once
// Chooses the quantised cores of a train: by step, by error, or by size.

#include "../../map/codec/quantized_cores.h"
#include "train_gauge.h"

namespace ttsdf {

class CoreQuantizer {
 public:
  /// A section in which everything is zero is smaller than this, whatever the train.
  static constexpr std::size_t kSmallestBytes = 512;

  explicit CoreQuantizer(const TensorTrain& train);

  /// Error at most `rms` [m] over the full array (checked on the result), and not much less.
  QuantizedCores toRms(double rms) const;
  /// The finest quantisation found whose section has at most `bytes` (>= kSmallestBytes).
  QuantizedCores toBytes(std::size_t bytes) const;
  /// Step of the middle core [m].
  QuantizedCores toStep(double step) const;

  /// rms over the full array of what quantisation changes [m]; exact, without the full array.
  double errorRms(const QuantizedCores& cores) const;

 private:
  /// The step that gives about this error if every coefficient were larger than it.
  double stepForRms(double rms) const;

  TrainGauge gauge_;
  double entries_;  ///< of the full array
};

}  // namespace ttsdf
