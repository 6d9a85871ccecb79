#pragma once
// A dense tensor and its weights as the slabs that the fits ask for.

#include <vector>

#include "ttsdf_localization/compression/sparse_fit.h"

namespace ttsdf {

/// References both, which must outlive it. Throws std::invalid_argument, naming `caller`, if shapes differ.
WeightedSlabSource denseSlabs(const DenseTensor& tensor, const std::vector<float>& weights,
                              const TensorTrain& train, const char* caller);

}  // namespace ttsdf
