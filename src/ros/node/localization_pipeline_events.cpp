// What changes the pose, the map or the options beside the scans, each under the lock of the scans; the
// service of a search around a pose; and what is known.

#include <stdexcept>
#include <utility>

#include "ros/messages/stamps.h"
#include "ros/node/localization_pipeline.h"

namespace ttsdf {

// ---- events
// -------------------------------------------------------------------------------------------------------

void LocalizationPipeline::useMap(LoadedMap map, std::optional<PoseRequest> pose) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (map.frame_id != frames_.global_frame_id) {
      ROS_INFO_STREAM_NAMED(name_, name_ << ": the map calls its frame '" << map.frame_id
                                         << "', it is used as '" << frames_.global_frame_id << "'");
    }
    ROS_INFO_STREAM_NAMED(name_, name_ << ": " << map.summary);
    if (map.of_atlas) {
      localizer_.localizer().exchangeMap(std::move(map.map));
    } else {
      localizer_.localizer().setMap(std::move(map.map));
      global_worker_->cancel();  // one in an atlas would give poses of other maps
      forgetUndecided();
      ++orders_;
    }
    map_id_ = map.map_id;
    map_summary_ = map.summary;
    map_message_.reset();
    if (!map.of_atlas) map_message_ = std::move(map.message);
    Status status = currentStatus();
    const auto state = localizer_.localizer().state();
    if (state != LocalizerState::kTracking && state != LocalizerState::kDegraded) tf_output_.stop();
    status.message = "map " + map_id_ + " is in use" + awaitedInputs();
    publishStatus(std::move(status), ros::Time::now(), false);
  }
  if (pose) usePose(std::move(*pose));
}

std::string LocalizationPipeline::awaitedInputs() const {
  const Localizer& localizer = localizer_.localizer();
  const bool waiting = localizer.state() == LocalizerState::kWaitingForPose;
  if (!waiting && localizer.state() != LocalizerState::kRelocalizing) return {};
  std::string text;
  if (waiting) {
    text = localizer.options().recovery.start_globally
               ? "; a global localization starts with the first scan"
               : "; waiting for a pose: initialpose, ~relocalize or ~global_localization";
  }
  if (!newest_scan_)
    text += "; waiting for scans on '" + scan_topics_ + "' and their transforms" + whyWaiting();
  return text;
}

void LocalizationPipeline::usePose(PoseRequest request) {
  const std::lock_guard<std::mutex> lock(mutex_);
  global_worker_->cancel();
  forgetUndecided();
  ++orders_;
  tf_output_.stop();
  const std::string message =
      request.guess.source + " taken" + (request.warning.empty() ? "" : "; " + request.warning);
  place_ = request.guess.T_map_base.translation();
  localizer_.usePose(std::move(request));
  Status status = currentStatus();
  status.message = message;
  publishStatus(std::move(status), ros::Time::now(), false);
}

void LocalizationPipeline::setPaused(bool paused) {
  const std::lock_guard<std::mutex> lock(mutex_);
  paused_ = paused;
  localizer_.queue().clear();
  Status status = currentStatus();
  status.message = paused ? "paused" : "running";
  publishStatus(std::move(status), ros::Time::now(), false);
}

void LocalizationPipeline::reset(std::optional<PoseRequest> start) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    global_worker_->cancel();
    forgetUndecided();
    ++orders_;
    tf_output_.stop();
    newest_scan_.reset();
    localizer_.reset();
    output_.clearPath();
    Status status = currentStatus();
    status.message = "reset";
    publishStatus(std::move(status), ros::Time::now(), false);
  }
  if (start) usePose(std::move(*start));
}

void LocalizationPipeline::timeJumpedBack(const std::string& why) {
  ROS_WARN_STREAM_NAMED(name_, name_ << ": " << why << ", starting again with the same map");
  const std::lock_guard<std::mutex> lock(mutex_);
  global_worker_->cancel();
  forgetUndecided();
  ++orders_;
  tf_output_.timeJumpedBack();
  newest_scan_.reset();
  localizer_.timeJumpedBack();
  output_.clearPath();
  last_look_ = ros::Time::now();
  Status status = currentStatus();
  status.reason = Status::REASON_TIME_JUMP;
  status.message = why;
  publishStatus(std::move(status), ros::Time::now(), false);
}

void LocalizationPipeline::requestUpdate() {
  const std::lock_guard<std::mutex> lock(mutex_);
  localizer_.requestUpdate();
}

void LocalizationPipeline::setOptions(const LocalizationRosOptions& options) {
  const std::lock_guard<std::mutex> lock(mutex_);
  localizer_.setOptions(options);
  tf_output_.setTiming(options.frames.transform_tolerance, options.frames.tf_rate,
                       options.localizer.motion.max_extrapolation);
}

void LocalizationPipeline::setWiderSearch(WiderSearch search) {
  global_worker_->cancel();
  global_worker_->wait();
  const std::lock_guard<std::mutex> lock(mutex_);
  forgetUndecided();
  wider_search_ = std::move(search);
}

void LocalizationPipeline::publishEvent(std::uint8_t reason, const std::string& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Status status = currentStatus();
  status.reason = reason;
  status.message = message;
  publishStatus(std::move(status), ros::Time::now(), false);
}

void LocalizationPipeline::tick(const std::string& scans_waiting) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const double seconds = secondsSinceLastLook();
  if (paused_) return;
  localizer_.advanceTime(seconds);
  if (const std::optional<LocalizationUpdate> update = localizer_.checkSilence()) {
    if (update->state == LocalizerState::kLost) tf_output_.stop();
    Status status = toStatus(*update);
    if (!scans_waiting.empty()) {
      status.reason = Status::REASON_NO_TRANSFORM;
      status.message += "; " + scans_waiting;
    }
    publishStatus(std::move(status), ros::Time::now(), false);
  } else if (!scans_waiting.empty() && (ros::WallTime::now() - last_waiting_status_).toSec() >= 1.0) {
    last_waiting_status_ = ros::WallTime::now();
    Status status = currentStatus();
    status.reason = Status::REASON_NO_TRANSFORM;
    status.message = scans_waiting;
    publishStatus(std::move(status), ros::Time::now(), false);
  }
}

// ---- services
// -----------------------------------------------------------------------------------------------------

ttsdf_localization::TtSdfMap LocalizationPipeline::map() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!map_message_) throw std::runtime_error("no map");
  ttsdf_localization::TtSdfMap map = *map_message_;
  map.header.frame_id = frames_.global_frame_id;
  map.header.stamp = ros::Time::now();
  return map;
}

void LocalizationPipeline::relocalize(const std::optional<PoseRequest>& around,
                                      ttsdf_localization::Relocalize::Response& response) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Localizer& localizer = localizer_.localizer();
  if (!localizer.hasMap()) throw std::runtime_error("no map");
  const std::string stuck = whyNoScan();
  if (!stuck.empty()) throw std::runtime_error("no scan to relocalize with: " + stuck);
  const std::optional<PoseGuess> last = localizer.lastPose();
  if (!around && !last) throw std::runtime_error("there is no last pose");
  global_worker_->cancel();
  forgetUndecided();
  ++orders_;
  tf_output_.stop();
  const PoseGuess guess = around ? withOdometry(*around, buffer(), frames_) : *last;
  localizer_.dropPoseRequest();
  const LocalizationUpdate update = localizer.relocalize(newest_scan_->scan, guess);
  publishUpdate(update, *newest_scan_);
  response.success = update.relocalized;
  response.message = update.message;
  response.score = update.registration.score;
  if (update.relocalized) response.pose = output_.poseMessage(update, newest_scan_->header.stamp);
}

// ---- what is known
// ------------------------------------------------------------------------------------------------

LocalizationPipeline::View LocalizationPipeline::view() const {
  View view;
  const std::lock_guard<std::mutex> lock(mutex_);
  view.status = status_;
  view.status.state = paused_ ? std::uint8_t{Status::PAUSED} : statusState(localizer_.localizer().state());
  view.status.state_name = statusStateName(view.status.state);
  view.map_summary = map_summary_;
  view.paused = paused_;
  view.tf_wanted = frames_.tf_broadcast;
  const ros::Time now = ros::Time::now();
  view.tf_sent = tf_output_.isSending(now);
  view.tf_age = secondsBetween(tf_output_.lastStamp(), now);
  view.tf_frames = frames_.global_frame_id + " -> " +
                   (frames_.odom_frame_id.empty() ? frames_.base_frame_id : frames_.odom_frame_id);
  const std::lock_guard<std::mutex> counts_lock(counts_mutex_);
  view.scans = counts_;
  view.status.scans = counts_.received;
  view.status.refused = counts_.rejected;
  view.status.dropped = counts_.dropped;
  return view;
}

std::optional<Eigen::Vector3d> LocalizationPipeline::robotPosition() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const LocalizerState state = localizer_.localizer().state();
  if (state == LocalizerState::kTracking || state == LocalizerState::kDegraded) {
    const auto pose = localizer_.localizer().lastPose();
    if (pose) place_ = pose->T_map_base.translation();
  }
  return place_;
}

std::optional<PoseGuess> LocalizationPipeline::trackedPose() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (localizer_.localizer().state() != LocalizerState::kTracking) return std::nullopt;
  return localizer_.localizer().lastPose();
}

}  // namespace ttsdf
