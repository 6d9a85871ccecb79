#include <ros/ros.h>

#include <exception>

#include "node_help.h"
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
  if (ttsdf::printedHelp(argc, argv, kHelp)) return 0;
  ros::init(argc, argv, "localization");
  const ros::NodeHandle node, private_node("~");  // outlive the try: with the last handle the log goes too
  try {
    const ttsdf::LocalizationRos localization(node, private_node, ros::this_node::getName());
    ros::spin();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM("does not start: " << error.what());
    return 1;
  }
  return 0;
}
