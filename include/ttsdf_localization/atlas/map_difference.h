#pragma once
// What a robot that holds some maps of an atlas needs at a place, and what it does not.

#include <string>
#include <vector>

#include "ttsdf_localization/atlas/atlas.h"

namespace ttsdf {

struct MapDifference {
  std::vector<std::size_t> missing;  ///< maps of the atlas near the place that are not held, nearest first
  std::vector<std::string> dropped;  ///< ids that are held and not near, in the order they were given
};

/// Near are maps whose box is at most `radius` [m] from `centre` (atlas frame). Throws std::invalid_argument
/// for a centre or radius that is not finite, or a radius below 0.
MapDifference mapDifference(const Atlas& atlas, const Eigen::Vector3d& centre, double radius,
                            const std::vector<std::string>& held_ids);

}  // namespace ttsdf
