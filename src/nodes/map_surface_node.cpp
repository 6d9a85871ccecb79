#include <ros/ros.h>

#include <exception>

#include "ttsdf_localization/ros/map_surface.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "map_surface");
  const ros::NodeHandle node, private_node("~");
  try {
    const ttsdf::MapSurface surface(node, private_node);
    ros::spin();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM("does not start: " << error.what());
    return 1;
  }
  return 0;
}
