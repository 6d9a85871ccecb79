// usage: map_server_node MAP.ttsdf, or with the parameter ~map_file.
#include <ros/ros.h>

#include <exception>
#include <string>

#include "ttsdf_localization/ros/map_server_ros.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "map_server");
  ros::NodeHandle nh;
  std::string map_file = argc > 1 ? argv[1] : "";
  if (map_file.empty()) ros::NodeHandle("~").getParam("map_file", map_file);
  if (map_file.empty()) {
    ROS_FATAL("Got no map file, wanted one as argument or parameter ~map_file");
    return 1;
  }
  try {
    const ttsdf::MapServerRos server(nh, map_file);
    ros::spin();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(error.what());
    return 1;
  }
  return 0;
}
