#pragma once
// Offers a map file: latched topics `ttsdf_map` and `occupancy_grid`, services `get_map` and
// `query_distances`. Core only.

#include <ros/ros.h>

#include <memory>
#include <string>

#include "ros/server/map_publisher.h"
#include "ros/server/planner_output.h"

namespace ttsdf {

class MapServerRos {
 public:
  /// `options` holds the parameters of PlannerOutput. Throws std::runtime_error or MapFormatError naming the
  /// file.
  MapServerRos(ros::NodeHandle nh, const ros::NodeHandle& options, const std::string& map_file);

 private:
  MapPublisher map_;
  std::unique_ptr<PlannerOutput> planners_;
};

}  // namespace ttsdf
