#include "map_ranking.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

namespace ttsdf {

namespace {

constexpr int kSteps = 8;            // along the way
constexpr double kFarthestWay = 50;  // [m] a velocity that is wrong must not ask for the whole atlas

Eigen::Vector3d predictedMotion(const RobotMotion& motion, double prediction) {
  Eigen::Vector3d way = prediction * motion.velocity;
  if (!way.allFinite()) return Eigen::Vector3d::Zero();
  const double length = way.norm();
  return length > kFarthestWay ? Eigen::Vector3d(way * (kFarthestWay / length)) : way;
}

std::vector<OrientedBox> boxesOf(const Atlas& atlas) {
  std::vector<OrientedBox> boxes;
  for (const AtlasMap& map : atlas.maps) boxes.push_back(map.box());
  return boxes;
}

std::vector<Eigen::AlignedBox3d> boundsOf(const std::vector<OrientedBox>& boxes) {
  std::vector<Eigen::AlignedBox3d> bounds;
  for (const OrientedBox& box : boxes) bounds.push_back(box.bounds());
  return bounds;
}

}  // namespace

MapRanking::MapRanking(const Atlas& atlas) : boxes_(boxesOf(atlas)), tree_(boundsOf(boxes_)) {}

MapRanking::Rank MapRanking::rank(std::size_t map, const RobotMotion& motion, double prediction) const {
  constexpr double kDepthCounts = 1e-3;  // orders maps that hold the robot, and nothing else
  constexpr double kLaterCounts = 0.5;   // a metre ahead is as urgent as half a metre aside
  const Eigen::Vector3d way = predictedMotion(motion, prediction);
  const double length = way.norm();
  const int steps = length > 0.0 ? kSteps : 0;
  Rank best{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  for (int n = 0; n <= steps; ++n) {
    const double share = static_cast<double>(n) / kSteps;
    const double depth = boxes_[map].depth(motion.position + share * way);
    const double distance = std::max(0.0, -depth);
    best.distance = std::min(best.distance, distance);
    best.cost =
        std::min(best.cost, distance + kLaterCounts * share * length - kDepthCounts * std::max(0.0, depth));
  }
  return best;
}

double MapRanking::distance(std::size_t map, const RobotMotion& motion, double prediction) const {
  return rank(map, motion, prediction).distance;
}

std::vector<MapRanking::Entry> MapRanking::near(const RobotMotion& motion, double prediction,
                                                double radius) const {
  Eigen::AlignedBox3d way(motion.position);
  way.extend(motion.position + predictedMotion(motion, prediction));
  std::vector<std::pair<double, Entry>> found;
  for (const std::size_t map : tree_.within(way, radius)) {
    const Rank one = rank(map, motion, prediction);
    if (one.distance <= radius) found.push_back({one.cost, {map, one.distance}});
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : a.second.map < b.second.map;
  });
  std::vector<Entry> entries;
  for (const auto& one : found) entries.push_back(one.second);
  return entries;
}

std::vector<std::size_t> MapRanking::around(const std::vector<std::size_t>& maps, double distance) const {
  std::set<std::size_t> found;
  for (const std::size_t map : maps) {
    const auto near = tree_.within(boxes_[map].bounds(), distance);
    found.insert(near.begin(), near.end());
  }
  for (const std::size_t map : maps) found.erase(map);
  return {found.begin(), found.end()};
}

}  // namespace ttsdf
