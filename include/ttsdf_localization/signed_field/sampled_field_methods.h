#pragma once
// The methods of sampleField, on plain arrays.

#include "ttsdf_localization/signed_field/sampled_field.h"
#include "ttsdf_localization/surface/observed_grid.h"
#include "ttsdf_localization/surface/observed_surface.h"

namespace ttsdf {

/// Smaller pieces of observed surface are noise [vertices, one per crossed cell].
constexpr int kMinSurfacePiece = 50;

/// Signed distance to the observed surface. Throws std::runtime_error if nothing was observed.
SampledField sampleSurfaceDistance(const ObservedGrid& observed, const BuildOptions& options,
                                   const BuildProgress& progress);

/// The paper's: occupied where the fused distance is negative, exact distance transform both ways.
SampledField sampleOccupancyDistance(const ObservedGrid& observed, const BuildOptions& options,
                                     const BuildProgress& progress);

/// The fused truncated distance itself, +truncation where nothing was observed.
SampledField sampleTruncatedDistance(const ObservedGrid& observed, const BuildOptions& options,
                                     const BuildProgress& progress);

}  // namespace ttsdf
