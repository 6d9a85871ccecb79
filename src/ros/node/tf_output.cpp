#include "ros/node/tf_output.h"

#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <utility>

#include "ros/messages/conversions.h"
#include "ros/messages/stamps.h"

namespace ttsdf {

TfOutput::TfOutput(ros::NodeHandle& node, Options options) : options_(std::move(options)) {
  publisher_ = node.advertise<tf2_msgs::TFMessage>("/tf", 100);
}

void TfOutput::update(const Eigen::Isometry3d& T_parent_child, const Vector6d& twist,
                      const ros::Time& scan_stamp, const ros::Time& now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  T_parent_child_ = T_parent_child;
  twist_ = twist;
  scan_stamp_ = scan_stamp;
  updated_ = now;
  const ros::Time stamp = addSeconds(scan_stamp, options_.tolerance);
  // Where a repetition has gone further already, the next one carries the new transform.
  if (stamp > last_stamp_) {
    last_sent_ = now;
    send(T_parent_child, stamp);
  }
}

void TfOutput::tick(const ros::Time& now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!T_parent_child_ || now <= updated_ || secondsBetween(last_sent_, now) < 0.5 / options_.rate) return;
  const double elapsed = secondsBetween(updated_, now);
  Eigen::Isometry3d T = *T_parent_child_;
  if (options_.extrapolate) {
    if (elapsed > options_.max_extrapolation) return;
    T = T * expSe3(elapsed * twist_);
  }
  const ros::Time stamp = addSeconds(scan_stamp_, options_.tolerance + elapsed);
  if (stamp <= last_stamp_) return;
  last_sent_ = now;
  send(T, stamp);
}

void TfOutput::send(const Eigen::Isometry3d& T_parent_child, const ros::Time& stamp) {
  last_stamp_ = stamp;
  tf2_msgs::TFMessage message;
  message.transforms.resize(1);
  message.transforms[0].header.stamp = stamp;
  message.transforms[0].header.frame_id = options_.parent;
  message.transforms[0].child_frame_id = options_.child;
  message.transforms[0].transform = toTransformMessage(T_parent_child);
  publisher_.publish(message);
}

void TfOutput::stop() {
  const std::lock_guard<std::mutex> lock(mutex_);
  T_parent_child_.reset();
}

void TfOutput::timeJumpedBack() {
  const std::lock_guard<std::mutex> lock(mutex_);
  T_parent_child_.reset();
  last_stamp_ = last_sent_ = updated_ = ros::Time();
}

void TfOutput::setTiming(double tolerance, double rate, double max_extrapolation) {
  const std::lock_guard<std::mutex> lock(mutex_);
  options_.max_extrapolation = max_extrapolation;
  if (!options_.extrapolate) options_.tolerance = tolerance;
  options_.rate = rate;
}

bool TfOutput::isSending(const ros::Time& now) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!T_parent_child_) return false;
  return !options_.extrapolate || secondsBetween(updated_, now) <= options_.max_extrapolation;
}

ros::Time TfOutput::lastStamp() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return last_stamp_;
}

}  // namespace ttsdf
