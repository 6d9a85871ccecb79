#include <ros/ros.h>

#include <exception>

#include "node_help.h"
#include "ros/operator/operator_menu.h"

namespace {
constexpr ttsdf::NodeHelp kHelp{
    "operator_menu_node", "",
    R"(A ball above the robot in rviz with the localizer's state written above it; a right click on it opens a menu:
global localization, search near the last pose, pause, forget the pose, load and build maps.

subscribes  status, pose
publishes   operator/text, operator/update, operator/update_full
calls       ~global_localization, ~relocalize, ~pause, ~reset and ~load_map of the localizer, ~build_map of the
            map builder
)",
    "localization.launch operator_menu:=true"};
}  // namespace

int main(int argc, char** argv) {
  if (ttsdf::printedHelp(argc, argv, kHelp)) return 0;
  ros::init(argc, argv, "operator_menu");
  const ros::NodeHandle node, private_node("~");
  try {
    const ttsdf::OperatorMenu menu(node, private_node);
    ros::spin();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM("does not start: " << error.what());
    return 1;
  }
  return 0;
}
