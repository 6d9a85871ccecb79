#include <ros/ros.h>

#include <exception>

#include "ttsdf_localization/ros/localization_ros.h"

int main(int argc, char** argv) {
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
