#include "ros/demo/simulated_camera_ros.h"

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TransformStamped.h>

#include <sstream>

#include "ros/demo/depth_messages.h"
#include "ros/messages/conversions.h"
#include "ros/messages/stamps.h"

namespace ttsdf {

namespace {

geometry_msgs::TransformStamped stamped(const Eigen::Isometry3d& T_parent_child, const ros::Time& stamp,
                                        const std::string& parent, const std::string& child) {
  geometry_msgs::TransformStamped message;
  message.header.stamp = stamp;
  message.header.frame_id = parent;
  message.child_frame_id = child;
  message.transform = toTransformMessage(T_parent_child);
  return message;
}

}  // namespace

SimulatedCameraRos::SimulatedCameraRos(ros::NodeHandle nh, ros::NodeHandle private_nh)
    : options_(loadSimulatedCameraOptions(private_nh)), rig_(options_.rig), truth_tf_(options_.truth_tf) {
  image_ = nh.advertise<sensor_msgs::Image>("depth/image_raw", 3);
  info_ = nh.advertise<sensor_msgs::CameraInfo>("depth/camera_info", 3);
  cloud_ = nh.advertise<sensor_msgs::PointCloud2>("cloud", 3);
  truth_ = nh.advertise<geometry_msgs::PoseStamped>("ground_truth", 100);
  static_broadcaster_.sendTransform(
      stamped(rig_.cameraMount(), ros::Time::now(), options_.base_frame_id, options_.camera_frame_id));
  services_ = {private_nh.advertiseService("kidnap", &SimulatedCameraRos::kidnap, this),
               private_nh.advertiseService("pause_odometry", &SimulatedCameraRos::pauseOdometry, this),
               private_nh.advertiseService("truth_tf", &SimulatedCameraRos::setTruthTf, this),
               private_nh.advertiseService("stand_still", &SimulatedCameraRos::standStill, this)};
  timer_ = nh.createTimer(ros::Duration(1.0 / options_.rate), [this](const ros::TimerEvent&) { step(); });
}

void SimulatedCameraRos::step() {
  const ros::Time stamp = ros::Time::now();
  if (last_stamp_ && stamp <= *last_stamp_) {
    if (stamp < *last_stamp_) last_stamp_.reset();  // the clock was set back: go on from here
    return;
  }
  const double passed = last_stamp_ ? secondsBetween(*last_stamp_, stamp) : 0.0;
  last_stamp_ = stamp;
  seconds_ += passed;
  if (!standing_) moved_ += passed;
  const RigState state = rig_.advance(moved_);
  // Transforms and truth first: whoever gets the image finds them already there.
  publishTransforms(state, stamp);
  geometry_msgs::PoseStamped truth;
  truth.header.stamp = stamp;
  truth.header.frame_id = options_.global_frame_id;
  truth.pose = toPoseMessage(state.T_map_base);
  truth_.publish(truth);
  publishImages(state, stamp);
  if (ended()) {
    ROS_INFO("Simulated camera: end of the path after %.1f s", seconds_);
    ros::shutdown();
  }
}

bool SimulatedCameraRos::ended() const {
  return (options_.duration > 0.0 && seconds_ >= options_.duration) ||
         (options_.laps > 0.0 && moved_ >= options_.laps * rig_.trajectory().duration());
}

void SimulatedCameraRos::publishTransforms(const RigState& state, const ros::Time& stamp) {
  std::vector<geometry_msgs::TransformStamped> transforms;
  if (!odometry_paused_) {
    transforms.push_back(stamped(state.T_odom_base, stamp, options_.odom_frame_id, options_.base_frame_id));
  }
  if (truth_tf_) {
    const Eigen::Isometry3d T_map_odom = state.T_map_base * state.T_odom_base.inverse();
    transforms.push_back(stamped(T_map_odom, stamp, options_.global_frame_id, options_.odom_frame_id));
  }
  if (!transforms.empty()) broadcaster_.sendTransform(transforms);
}

void SimulatedCameraRos::publishImages(const RigState& state, const ros::Time& stamp) {
  const bool wants_image = image_.getNumSubscribers() > 0, wants_cloud = cloud_.getNumSubscribers() > 0;
  std_msgs::Header header;
  header.stamp = stamp;
  header.frame_id = options_.camera_frame_id;
  const CameraIntrinsics& intrinsics = rig_.camera().intrinsics();
  if (info_.getNumSubscribers() > 0) info_.publish(toCameraInfo(intrinsics, header));
  if (!wants_image && !wants_cloud) return;
  const DepthImage image = rig_.image(state);
  if (wants_image) image_.publish(toImageMessage(image, options_.depth_encoding, header));
  if (wants_cloud) cloud_.publish(toOrganisedCloud(image, intrinsics, header));
}

bool SimulatedCameraRos::kidnap(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  std::ostringstream message;
  message << "jumped " << rig_.jump(options_.kidnap_distance) << " m";
  response.success = true;
  response.message = message.str();
  return true;
}

bool SimulatedCameraRos::pauseOdometry(std_srvs::SetBool::Request& request,
                                       std_srvs::SetBool::Response& response) {
  odometry_paused_ = request.data;
  response.success = true;
  response.message = odometry_paused_ ? "odometry paused" : "odometry goes on";
  return true;
}

bool SimulatedCameraRos::setTruthTf(std_srvs::SetBool::Request& request,
                                    std_srvs::SetBool::Response& response) {
  truth_tf_ = request.data;
  response.success = true;
  response.message = truth_tf_ ? "true transform is broadcast" : "true transform is not broadcast";
  return true;
}

bool SimulatedCameraRos::standStill(std_srvs::SetBool::Request& request,
                                    std_srvs::SetBool::Response& response) {
  standing_ = request.data;
  response.success = true;
  response.message = standing_ ? "the camera stands still" : "the camera moves";
  return true;
}

}  // namespace ttsdf
