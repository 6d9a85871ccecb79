#pragma once
// What several exports share.

#include <Eigen/Geometry>
#include <initializer_list>
#include <string>

#include "ttsdf_localization/field/grid_geometry.h"

namespace ttsdf {

/// ".ply" of "a/b.PLY"; empty without one.
std::string endingOf(const std::string& path);
/// Throws std::invalid_argument naming what, path and the endings wanted. Returns the path's.
std::string requireEnding(const char* what, const std::string& path,
                          std::initializer_list<const char*> wanted);
/// Around all samples of a grid, in the map's frame.
Eigen::AlignedBox3d boxOf(const GridGeometry& geometry);
/// Whole or not at all; an old file stays until then. Throws std::runtime_error naming the path.
void writeExport(const std::string& path, const std::string& bytes);

}  // namespace ttsdf
