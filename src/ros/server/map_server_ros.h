#pragma once
// Offers a map file: latched topic `ttsdf_map`, service `get_map`. Core only.

#include <ros/ros.h>

#include <string>

#include "ros/server/map_publisher.h"

namespace ttsdf {

class MapServerRos {
 public:
  /// Throws std::runtime_error or MapFormatError naming the file.
  MapServerRos(ros::NodeHandle nh, const std::string& map_file);

 private:
  MapPublisher map_;
};

}  // namespace ttsdf
