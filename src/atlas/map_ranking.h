#pragma once
// Which maps are wanted, the most useful first.

#include <vector>

#include "ttsdf_localization/atlas/atlas.h"
#include "ttsdf_localization/atlas/box_tree.h"

namespace ttsdf {

/// Where the robot is and how it moves.
struct RobotMotion {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< atlas frame [m]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
};

class MapRanking {
 public:
  explicit MapRanking(const Atlas& atlas);

  struct Entry {
    std::size_t map;  ///< index in the atlas
    double distance;  ///< from the way of the next `prediction` seconds to the box [m]
  };
  /// Maps at most `radius` away from the way, nearest first; of those that hold it, those the robot is in
  /// before those it will come to, then the deepest.
  std::vector<Entry> near(const RobotMotion& motion, double prediction, double radius) const;
  /// The same of one map.
  double distance(std::size_t map, const RobotMotion& motion, double prediction) const;
  /// Maps whose boxes are at most `distance` [m] away from those of `maps`, without these; rising.
  std::vector<std::size_t> around(const std::vector<std::size_t>& maps, double distance) const;
  /// Whether a map holds the position.
  bool holds(std::size_t map, const Eigen::Vector3d& position) const {
    return boxes_[map].depth(position) >= 0.0;
  }

 private:
  struct Rank {
    double distance, cost;
  };
  Rank rank(std::size_t map, const RobotMotion& motion, double prediction) const;

  std::vector<OrientedBox> boxes_;
  BoxTree tree_;
};

}  // namespace ttsdf
