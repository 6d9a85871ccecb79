#include <ros/ros.h>

#include <exception>
#include <fstream>
#include <iostream>

#include "node_main.h"
#include "ros/demo/demo_ros.h"

namespace {

constexpr ttsdf::NodeHelp kHelp{
    "demo_node", "",
    R"(Leads the demo: lets the simulated camera drive, has a map built and saved, loads it in the localizer,
measures the localization and prints a summary. Needs the other nodes of its launch file.
)",
    "demo.launch"};

/// Runs the demo; the summary of one that broke off says why.
std::string runDemo(ttsdf::DemoRos& demo) {
  try {
    return ttsdf::toText(demo.run());
  } catch (const std::exception& error) {
    return std::string("FAILED: ") + error.what() + '\n';
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (ttsdf::printedHelp(argc, argv, kHelp)) return 0;
  ros::init(argc, argv, "demo");
  ros::NodeHandle nh, private_nh("~");
  try {
    ttsdf::DemoRos demo(nh, private_nh);
    ros::AsyncSpinner spinner(1);
    spinner.start();
    const std::string summary = runDemo(demo);
    std::cout << summary << std::flush;
    if (!demo.options().summary_file.empty()) std::ofstream(demo.options().summary_file) << summary;
    return summary.find("FAILED") == std::string::npos ? 0 : 1;
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(error.what());
    return 1;
  }
}
