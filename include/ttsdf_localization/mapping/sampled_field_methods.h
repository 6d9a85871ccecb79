#pragma once
// The methods of sampleField, on plain arrays.

#include "ttsdf_localization/mapping/map_builder.h"
#include "ttsdf_localization/mapping/observed_grid.h"
#include "ttsdf_localization/mapping/observed_surface.h"

namespace ttsdf {

constexpr int kMaskCellVoxels = 4;
constexpr int kMinSurfacePiece =
    50;  ///< smaller pieces of observed surface are noise [vertices, one per crossed cell]

/// Samples from bounds - margin to bounds + margin along the axes of `R_map_grid`; without a turn they
/// coincide with the samples voxel_size * integer of the map frame.
GridGeometry gridAround(const Eigen::Matrix3Xf& points_map, const Eigen::Matrix3d& R_map_grid,
                        double voxel_size, double margin);

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
