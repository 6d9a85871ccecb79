#pragma once
// What planners take from a map: an occupancy grid on a latched topic, and distances of batches of points by
// a service.

#include <ros/ros.h>

#include <memory>

#include "ttsdf_localization/QueryDistances.h"
#include "ttsdf_localization/field/distance_field.h"
#include "ttsdf_localization/map/tt_sdf_map.h"

namespace ttsdf {

class PlannerOutput {
 public:
  /// Publishes `occupancy_grid` (nav_msgs/OccupancyGrid, latched) and offers `query_distances` in `nh`.
  /// Parameters of `options`: occupancy/resolution, occupancy/min_height, occupancy/max_height [m]. A range
  /// of heights that the map does not have is a warning, and no grid is published.
  PlannerOutput(ros::NodeHandle nh, const ros::NodeHandle& options, const TtSdfMap& map);

 private:
  void publishGrid(const ros::NodeHandle& options, const TtSdfMap& map);
  bool query(ttsdf_localization::QueryDistances::Request& request,
             ttsdf_localization::QueryDistances::Response& response);

  std::shared_ptr<const DistanceField> field_;
  std::string frame_id_;
  ros::Publisher grid_;
  ros::ServiceServer service_;
};

}  // namespace ttsdf
