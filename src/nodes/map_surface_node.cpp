#include <ros/ros.h>

#include <exception>

#include "node_help.h"
#include "ros/operator/map_surface.h"

namespace {
constexpr ttsdf::NodeHelp kHelp{
    "map_surface_node", "",
    R"(Shows in rviz the surface of the map that a localizer uses; asks for it with the localizer's ~get_map.

subscribes  status
publishes   map_surface
)",
    "localization.launch operator_menu:=true"};
}  // namespace

int main(int argc, char** argv) {
  if (ttsdf::printedHelp(argc, argv, kHelp)) return 0;
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
