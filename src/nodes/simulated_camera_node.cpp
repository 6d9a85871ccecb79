#include "node_main.h"
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
  return ttsdf::runNode(argc, argv, "simulated_camera", kHelp,
                        [](const ros::NodeHandle& node, const ros::NodeHandle& private_node) {
                          return ttsdf::SimulatedCameraRos(node, private_node);
                        });
}
