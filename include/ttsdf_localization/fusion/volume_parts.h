#pragma once
// A volume cut into parts, each small enough for a map of its own.

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "ttsdf_localization/fusion/tsdf_volume.h"

namespace ttsdf {

/// Box of the observed surface and its band, map frame [m]; empty if nothing was observed.
Eigen::AlignedBox3d surfaceBounds(const TsdfVolume& volume);

/// What of a volume lies in a box of the map frame. Costs memory and time of the part, and a walk over the
/// nodes of the whole.
TsdfVolume partOf(const TsdfVolume& volume, const Eigen::AlignedBox3d& box_map);

/// Tells volumes apart: of equal ones, cut or fused in the same way, equal (FNV-1a, 64 bits).
std::uint64_t contentSum(const TsdfVolume& volume);

struct VolumeCell {
  std::string name;         ///< "x0_y2_z1"
  Eigen::AlignedBox3d box;  ///< with the overlap [m]
};

/// Cells of equal size, at most `size` [m] along each axis, that cover a box; neighbours share `overlap` [m].
/// Throws std::invalid_argument for an empty box, sizes that are not positive, an overlap that is not smaller
/// than the size, or more than 100000 cells.
std::vector<VolumeCell> cellsOf(const Eigen::AlignedBox3d& box, double size, double overlap);

}  // namespace ttsdf
