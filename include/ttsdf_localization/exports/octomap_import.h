#pragma once
// Octrees of octomap (.bt, .ot) as points of surfaces, read in a process of their own.

#include <string>

#include "ttsdf_localization/fusion/cloud_surface.h"

namespace ttsdf {

/// Occupied cells that touch free ones, with normals towards these. `resolution` receives the octree's [m].
/// Throws std::runtime_error naming the file: unreadable, damaged, no surface.
OrientedCloud readOctomap(const std::string& path, double* resolution = nullptr);

}  // namespace ttsdf
