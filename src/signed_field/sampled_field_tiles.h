#pragma once

#include "ttsdf_localization/signed_field/sampled_field.h"

namespace ttsdf {

/// Whether sampleField works in tiles: method "surface" with both clamps (a value then depends on its
/// surroundings only) on a grid of more than options.max_dense_voxels.
bool needsTiles(const TsdfVolume& volume, const BuildOptions& options);

/// The same field as sampleSurfaceDistance's, sampled tile by tile into bricks: memory for one tile per
/// thread and about a byte per voxel. Values and knowledge are the same; values that mean nothing may differ,
/// and so may the support of voxels beyond the clamp from every surface, where a tile cannot see the surface:
/// free ones are supported unless unobserved space is nearer than the clamp. Throws std::runtime_error if
/// nothing was observed.
SampledField sampleSurfaceTiles(const TsdfVolume& volume, const BuildOptions& options,
                                const BuildProgress& progress);

}  // namespace ttsdf
