#pragma once

#include "block_update.h"

namespace ttsdf {

/// Voxels of the block at `origin` that have a negative voxel (band or interior) within `radius` voxels along
/// every axis (a cube), radius at most 4. Reads the neighbouring blocks too; thread-safe while nobody writes.
BlockMask nearNegative(const openvdb::FloatTree& tsdf, const openvdb::Coord& origin, int radius);

}  // namespace ttsdf
