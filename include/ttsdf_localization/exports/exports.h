#pragma once
// What leaves a map: its surface, its field, its occupied space, in files that other programs read.

#include <string>

#include "ttsdf_localization/map/tt_sdf_map.h"
#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf {

/// .ply, .obj or .stl by the ending. Throws std::invalid_argument for another ending, an empty mesh, or an
/// .stl of a place that single precision cannot hold; std::runtime_error if it cannot be written.
void writeSurface(const SurfaceMesh& mesh, const std::string& path);
/// The mesh's vertices with normals: .pcd (binary) or .ply. Throws as writeSurface.
void writeSurfaceCloud(const SurfaceMesh& mesh, const std::string& path);
/// The distances where the map knows anything, as a grid "distance" of OpenVDB; background: the clamp.
/// Decompresses the map.
void writeVdb(const TtSdfMap& map, const std::string& path);
/// Occupied and free cells of the map's voxel size (or `resolution`), as a binary octree (.bt). Returns the
/// occupied cells.
std::size_t writeOctomap(const TtSdfMap& map, const std::string& path, double resolution = 0.0);
/// Distances of a horizontal slice: .csv (x, y, distance; unknown ones left out) or .pgm (grey: -20 to 20 cm;
/// unknown black).
void writeSlice(const TtSdfMap& map, double height, const std::string& path);

}  // namespace ttsdf
