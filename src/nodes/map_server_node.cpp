#include <ros/ros.h>

#include <exception>
#include <filesystem>
#include <memory>
#include <string>

#include "node_help.h"
#include "ros/server/atlas_server_ros.h"
#include "ros/server/map_server_ros.h"

namespace {
constexpr ttsdf::NodeHelp kHelp{
    "map_server_node", "[MAP.ttsdf | FOLDER] ",
    R"(Offers a map file or the folder of an atlas to others; without an argument, that of the parameter ~map_file.

a map       publishes ttsdf_map, occupancy_grid (parameters ~occupancy/resolution, min_height, max_height);
            services get_map, query_distances
an atlas    publishes atlas (what maps there are, again when atlas.yaml changes);
            services get_differential_map, get_selected_maps
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
    std::unique_ptr<ttsdf::AtlasServerRos> atlas;
    std::unique_ptr<ttsdf::MapServerRos> map;
    if (std::filesystem::is_directory(map_file)) {
      atlas = std::make_unique<ttsdf::AtlasServerRos>(nh, map_file);
    } else {
      map = std::make_unique<ttsdf::MapServerRos>(nh, ros::NodeHandle("~"), map_file);
    }
    ros::spin();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(error.what());
    return 1;
  }
  return 0;
}
