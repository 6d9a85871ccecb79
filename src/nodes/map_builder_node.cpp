#include <ros/ros.h>

#include <exception>

#include "node_help.h"
#include "ros/builder/map_builder_ros.h"

namespace {
constexpr ttsdf::NodeHelp kHelp{
    "map_builder_node", "",
    R"(Builds a compressed map: clouds whose poses TF knows are fused, and compressed on request.

subscribes  cloud, /tf, /tf_static
publishes   ttsdf_map, ~surface, ~slice, ~progress, /diagnostics
services    ~build_map, ~save_map, ~load_map, ~reset, get_map
)",
    "build_map.launch"};
}  // namespace

int main(int argc, char** argv) {
  if (ttsdf::printedHelp(argc, argv, kHelp)) return 0;
  ros::init(argc, argv, "map_builder");
  ros::NodeHandle nh, private_nh("~");
  try {
    const ttsdf::MapBuilderRos builder(nh, private_nh);
    ros::spin();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(error.what());
    return 1;
  }
  return 0;
}
