#pragma once
// Maps made from maps: smaller ranks, a part of one, two in one.

#include <Eigen/Geometry>

#include "ttsdf_localization/compression/tt_svd.h"
#include "ttsdf_localization/map/tt_sdf_map.h"

namespace ttsdf {

/// The same map with lower ranks (options as in `round`).
TtSdfMap recompressed(const TtSdfMap& map, const TtSvdOptions& options);

/// The part of a map that covers a box of the map frame [m], at least two samples wide on every axis; whole
/// cells of the support mask. Ranks stay. Throws std::invalid_argument if the box is empty or misses the map.
TtSdfMap cropped(const TtSdfMap& map, const Eigen::AlignedBox3d& box_map);

/// Two maps as one, in the frame and with the grid axes and voxel size of the first; T_a_b puts the second
/// one there. A voxel takes the value nearer to a surface of those maps that know the place; where neither
/// does, it is unknown. `options` cap the ranks of the result (an own decomposition). Throws
/// std::invalid_argument if the maps differ in kind, or if the common box has more than 2^31 voxels.
TtSdfMap merged(const TtSdfMap& a, const TtSdfMap& b, const Eigen::Isometry3d& T_a_b,
                const TtSvdOptions& options);

}  // namespace ttsdf
