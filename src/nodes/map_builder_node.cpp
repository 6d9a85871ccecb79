#include "node_main.h"
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
  return ttsdf::runNode(argc, argv, "map_builder", kHelp,
                        [](const ros::NodeHandle& node, const ros::NodeHandle& private_node) {
                          return ttsdf::MapBuilderRos(node, private_node);
                        });
}
