#pragma once
// What several exports share.

#include <Eigen/Geometry>
#include <string>

#include "ttsdf_localization/field/grid_geometry.h"

namespace ttsdf {

/// Around all samples of a grid, in the map's frame.
Eigen::AlignedBox3d boxOf(const GridGeometry& geometry);
/// Whole or not at all; an old file stays until then. Throws std::runtime_error naming the path.
void writeExport(const std::string& path, const std::string& bytes);

}  // namespace ttsdf
