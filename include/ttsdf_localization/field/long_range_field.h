#pragma once
// The far field, made again when a map is loaded: a map stores distances exactly near the surface and clamps
// them further out (that is where the bytes go), and a coarse grid of distances to the surface that the map
// itself describes pulls scans in from metres away.

#include <memory>

#include "ttsdf_localization/field/dense_distance_field.h"

namespace ttsdf {

struct LongRangeOptions {
  double spacing_voxels = 4.0;        ///< grid spacing in voxels of the map
  double padding = 1.0;               ///< the coarse grid reaches this far beyond the map's box [m]
  std::size_t max_samples = 4000000;  ///< the spacing grows until the coarse grid has at most so many
};

/// Dense coarse field: |value| = distance to the nearest foot point of the map's zero level [m], with the
/// map's sign inside its box. Everywhere valid: it says where to go, not whether the map knows the place.
/// Exact to about a voxel of the map; cost about 1 us per coarse sample. Returns null if the map shows no
/// surface.
std::shared_ptr<const DenseDistanceField> makeLongRangeField(const DistanceField& field,
                                                             const LongRangeOptions& options = {});

}  // namespace ttsdf
