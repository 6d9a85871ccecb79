#include <ros/ros.h>

#include <exception>

#include "node_help.h"
#include "ros/demo/simulated_camera_ros.h"

namespace {
constexpr ttsdf::NodeHelp kHelp{
    "simulated_camera_node", "",
    R"(A depth camera that drives through an analytic world, with noise, drifting odometry and the exact truth.

publishes   depth/image_raw, depth/camera_info, cloud, ground_truth, /tf
services    ~kidnap, ~pause_odometry, ~truth_tf, ~stand_still
)",
    "demo.launch"};
}  // namespace

int main(int argc, char** argv) {
  if (ttsdf::printedHelp(argc, argv, kHelp)) return 0;
  ros::init(argc, argv, "simulated_camera");
  ros::NodeHandle nh, private_nh("~");
  try {
    const ttsdf::SimulatedCameraRos camera(nh, private_nh);
    ros::spin();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(error.what());
    return 1;
  }
  return 0;
}
