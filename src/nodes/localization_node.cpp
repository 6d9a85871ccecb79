#include "node_main.h"
#include "ros/node/localization_ros.h"

namespace {
constexpr ttsdf::NodeHelp kHelp{
    "localization_node", "",
    R"(Localizes a depth camera in a compressed map: clouds, TF and a map in, the pose of the base out.

subscribes  cloud, initialpose, /tf, /tf_static; by parameter ttsdf_map, atlas, imu
publishes   pose, odometry, status, aligned_cloud, path, /tf, /diagnostics,
            ~parameter_descriptions, ~parameter_updates
services    ~load_map, ~get_map, ~set_map, ~relocalize, ~global_localization, ~request_nomotion_update, ~pause, ~reset,
            ~set_parameters
)",
    "localization.launch map_file:=/path/room.ttsdf"};
}  // namespace

int main(int argc, char** argv) {
  return ttsdf::runNode(argc, argv, "localization", kHelp,
                        [](const ros::NodeHandle& node, const ros::NodeHandle& private_node) {
                          return ttsdf::LocalizationRos(node, private_node, ros::this_node::getName());
                        });
}
