#pragma once
// Inside and outside of a mesh on a grid, whatever way its faces are turned.

#include <cstdint>
#include <vector>

#include "ttsdf_localization/surface/nearest_surface.h"

namespace ttsdf {

/// 1 where the outside cannot be flooded to. Samples within half a voxel of the mesh form a shell that a
/// flood through face neighbours cannot cross; each of them takes the side of the neighbours that lie on its
/// side of the mesh. The outermost samples must lie outside. `mesh` in index coordinates, `nearest` of the
/// same mesh.
std::vector<std::uint8_t> enclosedSamples(const SurfaceMesh& mesh, const NearestSurface& nearest,
                                          const Dims& dims, int threads);

/// Share of the edges that two triangles use in opposite directions: 1 for a closed mesh that is turned
/// consistently.
double orientedShare(const SurfaceMesh& mesh);

/// Volume by the divergence theorem: exact for a closed, consistently turned mesh, little off for one with
/// holes.
double enclosedVolume(const SurfaceMesh& mesh);

}  // namespace ttsdf
