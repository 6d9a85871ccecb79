// Poses from outside.

#include <exception>
#include <utility>

#include "ttsdf_localization/ros/localization_ros.h"

namespace ttsdf {

void LocalizationRos::onInitialPose(const geometry_msgs::PoseWithCovarianceStampedConstPtr& message) {
  try {
    PoseRequest request = readPose(*message, tf_buffer_, options_.frames, "initialpose");
    if (!request.warning.empty()) ROS_WARN_STREAM_NAMED(name_, name_ << ": " << request.warning);
    usePose(std::move(request));
  } catch (const std::exception& error) {
    const std::string text = std::string("initialpose refused: ") + error.what();
    ROS_ERROR_STREAM_NAMED(name_, name_ << ": " << text);
    announce(std_msgs::Header(), Status::REASON_NO_START_POSE, text);
  }
}

void LocalizationRos::usePose(PoseRequest request) {
  const std::lock_guard<std::mutex> lock(mutex_);
  global_worker_->cancel();
  ++orders_;
  localizer_.setGuess(request.guess);
  tf_output_.stop();
  Status status;
  status.state = statusState(localizer_.state());
  status.message = request.guess.source + " taken" + (request.warning.empty() ? "" : "; " + request.warning);
  pose_request_ = std::move(request);
  publishStatus(std::move(status), std_msgs::Header());
}

void LocalizationRos::addOdometryToPose() {
  // Only now: when the pose came in, the odometry of its stamp may not have been there yet.
  if (!pose_request_) return;
  localizer_.setGuess(withOdometry(*pose_request_, tf_buffer_, options_.frames));
  pose_request_.reset();
}

}  // namespace ttsdf
