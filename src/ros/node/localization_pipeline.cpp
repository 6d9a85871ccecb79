// The way of a scan: from the queue into the localizer, and what came of it out as topics and TF. Events and
// services are in localization_pipeline_events.cpp, global localization in localization_pipeline_global.cpp.

#include "ros/node/localization_pipeline.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "ros/messages/conversions.h"
#include "ros/messages/stamps.h"

namespace ttsdf {

namespace {
using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kLook{50};       // between two looks at scans that wait, without news
constexpr std::chrono::milliseconds kIdleLook{100};  // when none waits: for odometry that falls silent
constexpr std::chrono::microseconds kTurn{200};
constexpr double kLeftOutPeriod = 1.0;                  // [s] between two statuses of transforms left out
constexpr double kFastestClock = 20.0;                  // times real time
constexpr std::chrono::milliseconds kMostBacklog{150};  // busy for longer: only the newest scan counts

TfOutput::Options tfOptions(const LocalizationRosOptions& options) {
  const FrameOptions& frames = options.frames;
  TfOutput::Options tf;
  tf.parent = frames.global_frame_id;
  tf.rate = frames.tf_rate;
  tf.max_extrapolation = options.localizer.motion.max_extrapolation;
  tf.extrapolate = frames.odom_frame_id.empty();
  tf.child = tf.extrapolate ? frames.base_frame_id : frames.odom_frame_id;
  // A moving frame must not be dated ahead: it would lag by as much.
  tf.tolerance = tf.extrapolate ? 0.0 : frames.transform_tolerance;
  return tf;
}

std::string scanTopics(const ros::NodeHandle& node, const InputOptions& input) {
  std::string topics;
  for (const std::string& name : words(input.clouds + ' ' + input.depth_images))
    topics += (topics.empty() ? "" : " ") + node.resolveName(name);
  return topics;
}
}  // namespace

LocalizationPipeline::LocalizationPipeline(ros::NodeHandle& node, const LocalizationRosOptions& options,
                                           const std::string& name)
    : name_(name),
      frames_(options.frames),
      scan_topics_(scanTopics(node, options.input)),
      tf_output_(node, tfOptions(options)),
      localizer_(options),
      output_(node, options),
      last_look_(ros::Time::now()) {
  status_ = currentStatus();
  global_worker_ = std::make_unique<GlobalWorker>(GlobalWorker::Callbacks{
      [this](GlobalJob& job, const ProgressCallback& go_on) { runGlobal(job, go_on); },
      [this](double share) { onGlobalProgress(share); },
      [this](const GlobalJob& job) { onGlobalDone(job); }});
  thread_ = std::thread(&LocalizationPipeline::run, this);
}

LocalizationPipeline::~LocalizationPipeline() {
  stop();
  work_.notify_all();
  thread_.join();
  global_worker_->cancel();
  global_worker_->wait();
}

void LocalizationPipeline::stop() {
  stopping_ = true;
  global_worker_->cancel();
}

// ---- what comes in
// ------------------------------------------------------------------------------------------------

void LocalizationPipeline::addTransforms(const tf2_msgs::TFMessage& message, const std::string& authority,
                                         bool is_static) {
  const TransformsOutcome outcome = localizer_.addTransforms(message, authority, is_static, ros::Time::now());
  if (outcome.jumped_back) {
    timeJumpedBack("the transforms' stamps went back");
    localizer_.addTransforms(message, authority, is_static, ros::Time::now());
  }
  if (outcome.left_out > 0) warnLeftOut(outcome.why + " (from " + authority + ")");
  if (localizer_.queue().empty()) return;
  {
    const std::lock_guard<std::mutex> lock(work_mutex_);
    work_waits_ = true;
  }
  work_.notify_one();
}

void LocalizationPipeline::warnLeftOut(const std::string& transform) {
  const ros::WallTime now = ros::WallTime::now();
  if ((now - last_left_out_).toSec() < kLeftOutPeriod) return;
  last_left_out_ = now;
  const std::string message = "left out: " + transform;
  ROS_WARN_STREAM_NAMED(name_, name_ << ": " << message);
  publishEvent(Status::REASON_NO_TRANSFORM, message);
}

void LocalizationPipeline::noteArrival() {
  const std::lock_guard<std::mutex> lock(counts_mutex_);
  ++counts_.received;
  counts_.last_arrival = ros::WallTime::now();
}

void LocalizationPipeline::addScan(QueuedScan scan) {
  localizer_.queue().put(std::move(scan), ros::Time::now());
  {
    const std::lock_guard<std::mutex> lock(work_mutex_);
    work_waits_ = true;
  }
  work_.notify_one();
}

void LocalizationPipeline::rejectScan(const std_msgs::Header& header, const std::string& message) {
  {
    const std::lock_guard<std::mutex> lock(counts_mutex_);
    ++counts_.unreadable;
    ++counts_.rejected;
  }
  ROS_WARN_STREAM_THROTTLE_NAMED(5.0, name_, name_ << ": " << message);
  const std::lock_guard<std::mutex> lock(mutex_);
  Status status = currentStatus();
  status.reason = Status::REASON_BAD_CLOUD;
  status.message = message;
  publishStatus(std::move(status), header.stamp, true);
}

// ---- the thread
// ---------------------------------------------------------------------------------------------------

void LocalizationPipeline::run() {
  while (!stopping_) {
    {
      std::unique_lock<std::mutex> lock(work_mutex_);
      work_.wait_for(lock, localizer_.queue().empty() ? kIdleLook : kLook,
                     [this] { return work_waits_ || stopping_; });
      work_waits_ = false;
    }
    // A lock is not fair: events get their turn between two scans.
    while (!stopping_ && processNext()) std::this_thread::sleep_for(kTurn);
    busy_since_ = Clock::time_point();
  }
}

bool LocalizationPipeline::processNext() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Clock::time_point begin = Clock::now();
  if (busy_since_ == Clock::time_point()) busy_since_ = begin;
  std::optional<ScanOutcome> outcome;
  try {
    localizer_.advanceTime(secondsSinceLastLook());
    outcome = localizer_.next(ros::Time::now(), begin - busy_since_ > kMostBacklog);
    if (!outcome) return false;
    handle(std::move(*outcome));
  } catch (const std::exception& error) {  // out of memory, say: this process is shared, and lives on
    ROS_ERROR_STREAM_THROTTLE_NAMED(5.0, name_, name_ << ": " << error.what());
  }
  return true;
}

void LocalizationPipeline::handle(ScanOutcome outcome) {
  using Kind = ScanOutcome::Kind;
  const bool rejected = outcome.kind == Kind::kRejected || outcome.kind == Kind::kOld;
  const bool no_pose = rejected || (outcome.kind == Kind::kLocalized && !outcome.update.pose_valid);
  {
    const std::lock_guard<std::mutex> lock(counts_mutex_);
    if (outcome.kind == Kind::kOvertaken) ++counts_.dropped;
    if (outcome.kind == Kind::kSkipped) ++counts_.skipped;
    if (outcome.kind == Kind::kRejected) ++counts_.untransformed;
    if (no_pose) ++counts_.rejected;
    if (outcome.kind != Kind::kRejected) counts_.last_taken = ros::WallTime::now();
  }
  if (rejected) {
    const bool old = outcome.kind == Kind::kOld;
    Status status = currentStatus();
    status.reason = old ? statusReason(outcome.update.reason) : std::uint8_t{Status::REASON_NO_TRANSFORM};
    status.message = old ? outcome.update.message : outcome.message;
    ROS_WARN_STREAM_THROTTLE_NAMED(5.0, name_, name_ << ": " << status.message);
    publishStatus(std::move(status), outcome.header.stamp, true);
  }
  if (outcome.kind != Kind::kLocalized) return;
  newest_scan_ = SeenScan{outcome.header, std::move(outcome.scan), ros::WallTime::now()};
  publishUpdate(outcome.update, *newest_scan_);
  if (outcome.update.wants_global || hasDrivenOn(outcome.update, newest_scan_->scan))
    startGlobal(*newest_scan_, true);
}

void LocalizationPipeline::publishUpdate(const LocalizationUpdate& update, const SeenScan& seen) {
  const ros::Time stamp = seen.header.stamp;
  const bool in_use = update.state == LocalizerState::kTracking || update.state == LocalizerState::kDegraded;
  if (!in_use) {
    tf_output_.stop();
  } else if (update.pose_valid && frames_.tf_broadcast) {
    if (frames_.odom_frame_id.empty()) {
      tf_output_.update(update.T_map_base, update.twist, stamp, ros::Time::now());
    } else if (seen.scan.T_odom_base && update.T_map_odom) {
      tf_output_.update(*update.T_map_odom, Vector6d::Zero(), stamp, ros::Time::now());
    }
  }
  if (update.pose_valid) {
    forgetUndecided();
    output_.publish(update, seen.scan, stamp);
    pose_since_global_ = output_.poseMessage(update, stamp);
  }
  publishStatus(toStatus(update), stamp, true);
}

LocalizationPipeline::Status LocalizationPipeline::currentStatus() const {
  Status status;
  status.state = statusState(localizer_.localizer().state());
  return status;
}

void LocalizationPipeline::publishStatus(Status status, const ros::Time& stamp, bool of_a_scan) {
  status.header.stamp = stamp;
  status.header.frame_id = frames_.global_frame_id;
  status.map_id = map_id_;
  if (of_a_scan && !stamp.isZero()) status.latency = secondsBetween(stamp, ros::Time::now());
  status.progress = global_worker_ && global_worker_->running() ? global_worker_->progress() : 0.0;
  {
    const std::lock_guard<std::mutex> lock(counts_mutex_);
    status.scans = counts_.received;
    status.refused = counts_.rejected;
    status.dropped = counts_.dropped;
  }
  if (paused_) status.state = Status::PAUSED;
  status.state_name = statusStateName(status.state);
  if (status.state != status_.state) {
    const std::string text =
        name_ + ": " + status.state_name + (status.message.empty() ? "" : ": " + status.message);
    if (status.state == Status::LOST || status.state == Status::DEGRADED) {
      ROS_WARN_STREAM_NAMED(name_, text);
    } else {
      ROS_INFO_STREAM_NAMED(name_, text);
    }
  }
  output_.publish(status);
  status_ = std::move(status);
  status_changed_.notify_all();
}

/// A clock that steps forward is no silent camera, and a simulated one may run many times as fast as time
/// does.
double LocalizationPipeline::secondsSinceLastLook() {
  const ros::Time now = ros::Time::now();
  const Clock::time_point steady = Clock::now();
  double seconds = std::chrono::duration<double>(steady - last_steady_look_).count();
  if (ros::Time::isSimTime()) seconds = std::min(secondsBetween(last_look_, now), kFastestClock * seconds);
  last_look_ = now;
  last_steady_look_ = steady;
  return seconds;
}

}  // namespace ttsdf
