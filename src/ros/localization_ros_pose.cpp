// Poses from outside, and global localization.

#include <exception>
#include <utility>

#include "ttsdf_localization/ros/localization_ros.h"

namespace ttsdf {

namespace {
constexpr double kProgressPeriod = 0.2;  // [s] between two statuses of a global localization
}

void LocalizationRos::onInitialPose(const geometry_msgs::PoseWithCovarianceStampedConstPtr& message) {
  try {
    PoseRequest request = readPose(*message, tf_buffer_, options_.frames, "initialpose");
    if (!request.warning.empty()) ROS_WARN_STREAM_NAMED(name_, name_ << ": " << request.warning);
    usePose(std::move(request));
  } catch (const std::exception& error) {
    const std::string text = std::string("initialpose refused: ") + error.what();
    ROS_ERROR_STREAM_NAMED(name_, name_ << ": " << text);
    refuse(std_msgs::Header(), Status::REASON_NO_START_POSE, text);
  }
}

void LocalizationRos::usePose(PoseRequest request) {
  const std::lock_guard<std::mutex> lock(mutex_);
  global_worker_->cancel();
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

void LocalizationRos::startGlobal(const SeenScan& seen) {
  if (stopping_ || global_worker_->running()) return;
  tf_output_.stop();
  const auto down = gravity_.down(seen.header.frame_id, seen.header.stamp);
  global_outcome_.reset();
  GlobalJob job = localizer_.beginGlobal(seen.scan, down);
  if (!global_worker_->start(job)) {
    global_outcome_ = localizer_.finishGlobal(job);
    return;
  }
  Status status;
  status.state = statusState(localizer_.state());
  status.message = std::string("global localization ") + (down ? "with" : "without") + " gravity";
  publishStatus(std::move(status), std_msgs::Header());
}

void LocalizationRos::onGlobalProgress(double share) {
  const ros::WallTime now = ros::WallTime::now();
  const std::lock_guard<std::mutex> lock(mutex_);
  if ((now - last_progress_).toSec() < kProgressPeriod || !localizer_.globalRunning()) return;
  last_progress_ = now;
  Status status;
  status.state = statusState(localizer_.state());
  status.message = "global localization: " + std::to_string(static_cast<int>(100.0 * share)) + " %";
  publishStatus(std::move(status), std_msgs::Header());
}

void LocalizationRos::onGlobalDone(const GlobalJob& job) {
  const std::lock_guard<std::mutex> lock(mutex_);
  global_outcome_ = localizer_.finishGlobal(job);
  std_msgs::Header header;
  header.stamp.fromSec(job.scan().stamp);
  publishStatus(toStatus(*global_outcome_), header);
}

}  // namespace ttsdf
