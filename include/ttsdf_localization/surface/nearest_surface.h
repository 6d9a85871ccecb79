#pragma once
// For every sample of a grid the nearest point of a triangulated surface: VIGRA's exact vector distance
// transform finds a surface voxel near the foot, steps along the surface find the foot itself.

#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "ttsdf_localization/surface/surface_mesh.h"
#include "ttsdf_localization/surface/triangle_foot.h"
#include "ttsdf_localization/tensor/dense_tensor.h"

namespace ttsdf {

/// Splits triangles until no edge is longer than `max_edge`; keeps shared edges shared.
SurfaceMesh subdivided(const SurfaceMesh& mesh, float max_edge);

struct NearestSurfaceOptions {
  float exact_within = 1e9F;  ///< [voxel]; further out the distance may be up to two voxels too large
  /// Samples further out get no triangle and an infinite distance, and a mesh may be empty [voxel].
  float none_beyond = std::numeric_limits<float>::infinity();
  /// Per sample, if given: 0 for those that get no triangle, wherever they are.
  const std::vector<std::uint8_t>* wanted = nullptr;
  int threads = 2;
  std::function<void(double share)> report;  ///< may throw to cancel
};

struct NearestSurface {
  std::vector<std::int32_t> triangle;  ///< per sample, first index fastest; -1: no surface
  std::vector<float> distance;         ///< unsigned [voxel]; infinite without a triangle
};

/// `mesh` in index coordinates of the grid. Edges must not be longer than two voxels (see subdivided).
/// Throws std::invalid_argument for an empty mesh or one that lies outside the grid, unless none_beyond is
/// set.
NearestSurface nearestSurface(const SurfaceMesh& mesh, const Dims& dims,
                              const NearestSurfaceOptions& options);

}  // namespace ttsdf
