// What happens besides the scans: time jumps, warnings, diagnostics, the pose over restarts.

#include <algorithm>
#include <exception>

#include "ttsdf_localization/ros/localization_ros.h"
#include "ttsdf_localization/ros/pose_store.h"

namespace ttsdf {

namespace {
constexpr double kTransformPatience =
    2.0;  // [s] a cloud that waits longer for its transforms is worth a warning
}

void LocalizationRos::watch() {
  try {
    if (clock_watch_.clockJumped(ros::Time::now())) timeJumpedBack("the clock went back");
    if (!paused_) warnWhenQuiet();
    updateDiagnostics();
    if ((ros::WallTime::now() - last_pose_saved_).toSec() >= options_.start.save_pose_period) saveLastPose();
  } catch (const std::exception& error) {
    ROS_ERROR_STREAM_THROTTLE_NAMED(5.0, name_, name_ << ": " << error.what());
  }
}

void LocalizationRos::timeJumpedBack(const std::string& why) {
  ROS_WARN_STREAM_NAMED(name_, name_ << ": " << why << ", starting again with the same map");
  // The listener's thread must not walk through the buffer's requests while they are taken away.
  tf_listener_.reset();
  tf_buffer_.clear();
  clouds_->clear();
  tf_listener_ = std::make_unique<tf2_ros::TransformListener>(tf_buffer_, node_);
  scans_.clear();
  tf_output_.timeJumped();
  global_worker_->cancel();
  const std::lock_guard<std::mutex> lock(mutex_);
  ++epoch_;
  ++orders_;
  newest_scan_.reset();
  if (pose_request_) pose_request_->stamp = ros::Time();
  output_.clearPath();
  localizer_.timeJumpedBack();
  Status status;
  status.state = statusState(localizer_.state());
  status.reason = Status::REASON_TIME_JUMP;
  status.message = why;
  publishStatus(std::move(status), std_msgs::Header());
}

void LocalizationRos::warnWhenQuiet() {
  const CloudCounts counts = clouds_->counts();
  const ros::WallTime now = ros::WallTime::now();
  const double limit = quiet_limit_;
  const double quiet = (now - std::max(started_, counts.last_arrival)).toSec();
  const double stuck = (now - std::max(started_, counts.last_ready)).toSec();
  const bool warned = (now - last_quiet_warning_).toSec() < limit;
  if (quiet >= limit) {
    if (warned) return;
    last_quiet_warning_ = now;
    ROS_WARN_STREAM_NAMED(
        name_, name_ << ": no cloud on '" << clouds_->topic() << "' for " << static_cast<int>(quiet)
                     << " s. Is the camera running, and is the topic remapped? With depth "
                        "images instead of clouds: depth_image:=true of localization.launch.");
    return;
  }
  if (counts.received == 0 || stuck < std::min(limit, kTransformPatience)) return;
  const std::string why = clouds_->whyWaiting();
  if (why.empty()) return;
  if (!warned) {
    last_quiet_warning_ = now;
    ROS_WARN_STREAM_NAMED(name_, name_ << ": clouds wait for their transforms" << why);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  Status status;
  status.state = statusState(localizer_.state());
  status.reason = Status::REASON_NO_TRANSFORM;
  status.message = "clouds wait for their transforms" + why;
  publishStatus(std::move(status), std_msgs::Header());
}

void LocalizationRos::updateDiagnostics() {
  DiagnosticsSnapshot snapshot;
  snapshot.clouds = clouds_->counts();
  snapshot.cloud_topic = clouds_->topic();
  snapshot.quiet_limit = quiet_limit_;
  const double stuck = (ros::WallTime::now() - std::max(started_, snapshot.clouds.last_ready)).toSec();
  if (stuck > kTransformPatience) snapshot.why_waiting = clouds_->whyWaiting();
  snapshot.tf_wanted = options_.frames.tf_broadcast;
  snapshot.tf_active = tf_output_.active();
  snapshot.tf_age = (ros::Time::now() - tf_output_.lastStamp()).toSec();
  snapshot.tf_frames =
      options_.frames.global_frame_id + " -> " +
      (options_.frames.odom_frame_id.empty() ? options_.frames.base_frame_id : options_.frames.odom_frame_id);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    snapshot.status = status_;
    snapshot.status.state = paused_ ? std::uint8_t{Status::PAUSED} : statusState(localizer_.state());
    snapshot.status.state_name = statusStateName(snapshot.status.state);
    snapshot.map_summary = map_summary_;
  }
  diagnostics_.update(snapshot);
}

void LocalizationRos::saveLastPose() {
  last_pose_saved_ = ros::WallTime::now();
  if (options_.start.pose_file.empty()) return;
  std::optional<PoseGuess> pose;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (localizer_.state() == LocalizerState::kTracking) pose = localizer_.lastPose();
  }
  if (!pose) return;
  try {
    savePose(options_.start.pose_file, options_.frames.global_frame_id, *pose);
  } catch (const std::exception& error) {
    ROS_ERROR_STREAM_THROTTLE_NAMED(60.0, name_, name_ << ": " << error.what());
  }
}

void LocalizationRos::applyStartPose() {
  std::optional<PoseRequest> request;
  if (options_.start.set_initial_pose) request = startPose(options_.start);
  if (!options_.start.pose_file.empty()) {
    try {
      if (std::optional<PoseGuess> saved =
              loadPose(options_.start.pose_file, options_.frames.global_frame_id)) {
        request = PoseRequest{std::move(*saved), ros::Time(), ""};
      }
    } catch (const std::exception& error) {
      ROS_ERROR_STREAM_NAMED(name_, name_ << ": " << error.what());
    }
  }
  if (request) usePose(std::move(*request));
}

}  // namespace ttsdf
