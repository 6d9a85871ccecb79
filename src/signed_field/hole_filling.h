#pragma once

#include <cstdint>
#include <vector>

#include "ttsdf_localization/tensor/dense_tensor.h"

namespace ttsdf {

/// Gives the loose samples (1) a smooth course between the others: their means on coarser and coarser grids,
/// then nearly harmonic by relaxation on every level from the coarsest up. Deterministic for any number of
/// threads. Low-rank approximation then spends nothing on values that mean nothing.
void fillHoles(DenseTensor& values, const std::vector<std::uint8_t>& loose, int threads);

}  // namespace ttsdf
