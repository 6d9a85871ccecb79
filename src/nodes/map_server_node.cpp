#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>

#include "node_main.h"
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
  return ttsdf::runNode(
      argc, argv, "map_server", kHelp,
      [&](const ros::NodeHandle& node, const ros::NodeHandle& private_node) -> std::shared_ptr<void> {
        std::string map_file = argc > 1 ? argv[1] : "";
        if (map_file.empty()) private_node.getParam("map_file", map_file);
        if (map_file.empty())
          throw std::invalid_argument("got no map file, wanted one as argument or parameter ~map_file");
        if (std::filesystem::is_directory(map_file))
          return std::make_shared<ttsdf::AtlasServerRos>(node, map_file);
        return std::make_shared<ttsdf::MapServerRos>(node, private_node, map_file);
      });
}
