#include "ttsdf_localization/atlas/map_difference.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

namespace ttsdf {

MapDifference mapDifference(const Atlas& atlas, const Eigen::Vector3d& centre, double radius,
                            const std::vector<std::string>& held_ids) {
  if (!centre.allFinite() || !std::isfinite(radius) || radius < 0.0) {
    throw std::invalid_argument("got a sphere of radius " + std::to_string(radius) +
                                " m, wanted a finite centre and a radius of 0 or more");
  }
  const std::set<std::string> held(held_ids.begin(), held_ids.end());
  std::set<std::string> near;
  std::vector<std::pair<double, std::size_t>> missing;
  for (std::size_t n = 0; n < atlas.maps.size(); ++n) {
    const double distance = std::max(0.0, -atlas.maps[n].box().depth(centre));
    if (distance > radius) continue;
    near.insert(atlas.maps[n].map_id);
    if (held.count(atlas.maps[n].map_id) == 0) missing.emplace_back(distance, n);
  }
  std::sort(missing.begin(), missing.end());
  MapDifference difference;
  for (const auto& [distance, n] : missing) difference.missing.push_back(n);
  for (const std::string& id : held_ids) {
    if (near.count(id) == 0) difference.dropped.push_back(id);
  }
  return difference;
}

}  // namespace ttsdf
