#pragma once
// What a depth camera sees of a triangle mesh: the visible surface only.

#include <cstdint>

#include "ttsdf_localization/frames/depth_image.h"
#include "ttsdf_localization/simulation/depth_camera.h"
#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf {

/// Depth of the nearest triangle per pixel, seen from either side, then the camera's noise (none by default).
/// The principal point is the image centre. `frame` chooses the noise. Triangles that reach behind the image
/// plane are left out: the camera belongs outside the mesh. Throws std::invalid_argument for bad options, a
/// pose that is not finite or an index out of range.
DepthImage renderMesh(const SurfaceMesh& mesh, const DepthCameraOptions& options,
                      const Eigen::Isometry3d& T_map_camera, std::uint64_t frame = 0);

}  // namespace ttsdf
