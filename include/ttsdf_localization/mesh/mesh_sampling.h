#pragma once
// The signed field of a triangle mesh: closed models, scans with holes, and soups with faces turned anyhow.

#include "ttsdf_localization/signed_field/sampled_field.h"
#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf {

/// How inside was told from outside.
enum class MeshSides : std::uint8_t {
  kEnclosed,  ///< what the outside cannot be flooded to is inside; zero-thickness sheets are positive on both
              ///< sides
  kOriented,  ///< an open mesh whose faces agree on a direction: the side their normals point to is positive,
              ///< and beyond its border the map knows nothing (as for an observed surface)
  kUnsigned,  ///< an open mesh without a consistent direction: positive everywhere
};

/// Exact distance to the mesh over its box plus `options.margin` (at least three voxels). Of the options:
/// clamping, align_axes, support_mask, support_distance, margin, threads. `sides`, if given, receives how the
/// sign was found. Everything is known but space beyond the border of an open mesh. Throws
/// std::invalid_argument: an empty or broken mesh, a voxel size that is not positive or so small that the box
/// would have more than 2^31 voxels.
SampledField sampleMesh(const SurfaceMesh& mesh, double voxel_size, const BuildOptions& options,
                        const BuildProgress& progress = {}, MeshSides* sides = nullptr);

}  // namespace ttsdf
