#pragma once
// Quantised coefficients chosen for what they do to the samples that matter: one part after the other is
// rounded, and what is not yet rounded makes up for it.

#include <functional>

#include "../map/codec/quantized_cores.h"
#include "ttsdf_localization/compression/tt_weighted.h"

namespace ttsdf {

struct QuantizedFitOptions {
  int parts = 6;       ///< rounded one after the other
  int iterations = 4;  ///< of the fit before every part
  int threads = 1;
  /// Asked after every iteration; false: std::runtime_error "cancelled".
  std::function<bool()> keep_going;
};

/// Values [m] and weights as for fitSparse. Bases, steps and offsets of `cores` stay; of the middle core the
/// coefficients that are not zero get new values, at the same step.
void fitQuantized(const WeightedSlabSource& source, QuantizedCores& cores,
                  const QuantizedFitOptions& options);

}  // namespace ttsdf
