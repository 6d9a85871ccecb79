#pragma once

#include <vector>

#include "ttsdf_localization/mapping/map_builder.h"

namespace ttsdf {

/// Weight in (0, 1] per voxel for the fit: 1 at the surface, falling with the distance from it, little where
/// the map knows nothing (those values are nobody's business as long as they stay smooth).
std::vector<float> surfaceWeights(const SampledField& field, const BuildOptions& options);

}  // namespace ttsdf
