#include <ros/ros.h>

#include <exception>
#include <string>

#include "node_help.h"
#include "ros/server/map_server_ros.h"

namespace {
constexpr ttsdf::NodeHelp kHelp{
    "map_server_node", "[MAP.ttsdf] ",
    R"(Offers a map file to others; without an argument, that of the parameter ~map_file.

publishes   ttsdf_map, occupancy_grid (parameters ~occupancy/resolution, min_height, max_height)
services    get_map, query_distances
)",
    ""};
}  // namespace

int main(int argc, char** argv) {
  if (ttsdf::printedHelp(argc, argv, kHelp)) return 0;
  ros::init(argc, argv, "map_server");
  ros::NodeHandle nh;
  std::string map_file = argc > 1 ? argv[1] : "";
  if (map_file.empty()) ros::NodeHandle("~").getParam("map_file", map_file);
  if (map_file.empty()) {
    ROS_FATAL("Got no map file, wanted one as argument or parameter ~map_file");
    return 1;
  }
  try {
    const ttsdf::MapServerRos server(nh, ros::NodeHandle("~"), map_file);
    ros::spin();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(error.what());
    return 1;
  }
  return 0;
}
