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

/// The paper's: exact distance transform of occupied samples. sdf_method says what it leaves open:
/// occupancy_edt: occupied are the samples nearest to the zero crossings of the band, distances have no sign;
/// occupancy_edt_signed: the same with the sign of the fused distance, positive where nothing was observed;
/// occupancy_edt_negative: occupied is all that has a negative fused distance, distances both ways.
SampledField sampleOccupancyDistance(const ObservedGrid& observed, const BuildOptions& options,
                                     const BuildProgress& progress);

/// The fused truncated distance itself; where nothing was observed, the truncation with the sign of the
/// nearest observed sample.
SampledField sampleTruncatedDistance(const ObservedGrid& observed, const BuildOptions& options,
                                     const BuildProgress& progress);

}  // namespace ttsdf
