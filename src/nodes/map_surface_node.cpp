#include "node_main.h"
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
  return ttsdf::runNode(argc, argv, "map_surface", kHelp,
                        [](const ros::NodeHandle& node, const ros::NodeHandle& private_node) {
                          return ttsdf::MapSurface(node, private_node);
                        });
}
