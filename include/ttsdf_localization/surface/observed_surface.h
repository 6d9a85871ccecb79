#pragma once
// The observed surface as triangles: zero crossings between observed band neighbours of opposite sign, and
// nothing else. A fused TSDF is a shell; its back, and the border between free and unknown space, are no
// surfaces.

#include <cstdint>
#include <vector>

#include "ttsdf_localization/surface/observed_grid.h"
#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf {

struct ObservedSurface {
  SurfaceMesh mesh;
  Eigen::Matrix3Xf normals;  ///< per vertex, unit, towards free space, smoothed over the neighbours
  std::vector<std::uint8_t>
      border_edges;  ///< per triangle, bit e: its edge (e, e + 1 mod 3) ends the observed surface
  std::vector<std::uint8_t> border_vertex;  ///< per vertex: lies on such an edge
};

/// Dual mesh of the crossings (one vertex per cell that is crossed, the mean of the crossings on the cell's
/// edges; one quadrilateral per crossing). Crossings are linear interpolations of two neighbours, so the
/// slope of a projective distance does not matter. Connected pieces of fewer than `min_component` vertices
/// are noise and dropped; `keep_cut`: not those that reach the grid's outermost cells and may go on beyond.
ObservedSurface observedSurface(const ObservedGrid& grid, int min_component, int threads = 2,
                                bool keep_cut = false);

/// Normals and borders of any mesh whose triangles share vertices.
ObservedSurface describeSurface(SurfaceMesh mesh, int normal_smoothing);

}  // namespace ttsdf
