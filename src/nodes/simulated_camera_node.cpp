#include <ros/ros.h>

#include <exception>

#include "ttsdf_localization/ros/simulated_camera_ros.h"

int main(int argc, char** argv) {
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
