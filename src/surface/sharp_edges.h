#pragma once
// Edges and corners of a dual mesh, which averaging crossings rounds off by up to a voxel.

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

namespace ttsdf {

using Quads = std::vector<std::array<int, 4>>;

/// Moves vertices to where the planes around them meet, if two or three planes fit their surroundings (three
/// rings of vertices) well: flat to a tenth of a voxel and at least 35 degrees apart. Noise and curvature
/// fail that test and leave a vertex where it is. Returns per vertex whether it was moved. Coordinates in
/// voxels.
std::vector<std::uint8_t> sharpenEdges(std::vector<Eigen::Vector3f>& vertices, const Quads& quads,
                                       int threads);

}  // namespace ttsdf
