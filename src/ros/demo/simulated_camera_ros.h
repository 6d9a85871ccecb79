#pragma once
// The simulated depth camera as a node: images, calibration, clouds, drifting odometry on TF, and the truth
// beside them.

#include <ros/ros.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>

#include <optional>

#include "ros/demo/simulated_camera_options.h"

namespace ttsdf {

/// Topics `depth/image_raw`, `depth/camera_info`, `cloud` (both rendered only while somebody listens) and
/// `ground_truth` (pose of the base). TF odom -> base, base -> camera and, by request, the true map -> odom.
/// Services ~kidnap (jump along the path), ~pause_odometry (no TF of the odometry), ~truth_tf, ~stand_still.
class SimulatedCameraRos {
 public:
  /// Throws std::invalid_argument for bad parameters.
  SimulatedCameraRos(ros::NodeHandle nh, ros::NodeHandle private_nh);

 private:
  void step();
  void publishImages(const RigState& state, const ros::Time& stamp);
  void publishTransforms(const RigState& state, const ros::Time& stamp);
  bool ended() const;

  bool kidnap(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  bool pauseOdometry(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);
  bool setTruthTf(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);
  bool standStill(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);

  const SimulatedCameraOptions options_;
  SimulatedRig rig_;
  bool truth_tf_, odometry_paused_ = false, standing_ = false;
  std::optional<ros::Time> last_stamp_;
  double seconds_ = 0.0;  ///< since the start
  double moved_ = 0.0;    ///< of them not standing still

  ros::Publisher image_, info_, cloud_, truth_;
  tf2_ros::TransformBroadcaster broadcaster_;
  tf2_ros::StaticTransformBroadcaster static_broadcaster_;
  std::vector<ros::ServiceServer> services_;
  ros::Timer timer_;
};

}  // namespace ttsdf
