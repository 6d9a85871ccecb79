#include "ttsdf_localization/ros/localization_ros.h"

#include <exception>
#include <utility>

namespace ttsdf {

namespace {
TfOutput::Options tfOptions(const LocalizationRosOptions& options) {
  const FrameOptions& frames = options.frames;
  TfOutput::Options tf;
  tf.parent = frames.global_frame_id;
  tf.rate = frames.tf_rate;
  if (frames.odom_frame_id.empty()) {
    tf.child = frames.base_frame_id;
    tf.tolerance = 0.0;  // a moving frame must not be dated ahead: it would lag by as much
    tf.extrapolate = true;
    tf.max_extrapolation = options.localizer.motion.max_extrapolation;
  } else {
    tf.child = frames.odom_frame_id;
    tf.tolerance = frames.transform_tolerance;
  }
  return tf;
}

ros::NodeHandle onQueue(ros::NodeHandle node, ros::CallbackQueue& queue) {
  node.setCallbackQueue(&queue);
  return node;
}
}  // namespace

LocalizationRos::LocalizationRos(const ros::NodeHandle& node, const ros::NodeHandle& private_node,
                                 const std::string& name)
    : name_(name),
      node_(onQueue(node, input_queue_)),
      private_node_(onQueue(private_node, input_queue_)),
      service_node_(onQueue(private_node, service_queue_)),
      options_(loadLocalizationOptions(private_node)),
      tf_output_(node_, tfOptions(options_)),
      output_(node_, options_.frames, options_.output),
      gravity_(options_.gravity, options_.frames, tf_buffer_),
      diagnostics_(node_, private_node_, name),
      localizer_(options_.localizer),
      quiet_limit_(options_.output.quiet_warning_seconds),
      started_(ros::WallTime::now()) {
  global_worker_ = std::make_unique<GlobalWorker>(
      GlobalWorker::Callbacks{[this](double share) { onGlobalProgress(share); },
                              [this](const GlobalJob& job) { onGlobalDone(job); }});
  applyStartPose();
  subscribe();
  advertise();
  startTimers();
  live_parameters_ = std::make_unique<LiveParameters>(
      service_node_, options_, [this](const LocalizationRosOptions& options) { applyLive(options); });
  registration_thread_ = std::thread(&LocalizationRos::runRegistration, this);
  input_spinner_ = std::make_unique<ros::AsyncSpinner>(1, &input_queue_);
  service_spinner_ = std::make_unique<ros::AsyncSpinner>(2, &service_queue_);
  input_spinner_->start();
  service_spinner_->start();
}

LocalizationRos::~LocalizationRos() {
  // From the outside in: first nothing comes in any more, then what runs ends, then the rest goes.
  stopping_ = true;
  global_worker_->cancel();  // a caller that waits for it keeps its service busy
  for (ros::ServiceServer& service : services_) service.shutdown();
  live_parameters_->shutdown();
  initial_pose_subscriber_.shutdown();
  imu_subscriber_.shutdown();
  tf_timer_.stop();
  watch_timer_.stop();
  global_worker_->cancel();
  service_spinner_->stop();
  input_spinner_->stop();
  map_source_.reset();
  scans_.close();
  registration_thread_.join();
  // Only now: the last statuses of the threads ask the worker and the clouds for their counts.
  global_worker_->cancel();
  global_worker_->wait();
  tf_listener_.reset();
  clouds_.reset();
  saveLastPose();
}

void LocalizationRos::subscribe() {
  tf_listener_ = std::make_unique<tf2_ros::TransformListener>(tf_buffer_, node_);
  CloudInput::Callbacks callbacks;
  callbacks.arrived = [this](const std_msgs::Header& header) { return onArrived(header); };
  callbacks.ready = [this](const boost::shared_ptr<const CloudScan>& cloud, bool odometry) {
    onReady(cloud, odometry);
  };
  callbacks.refused = [this](const std_msgs::Header& header, std::uint8_t reason,
                             const std::string& message) { refuse(header, reason, message); };
  clouds_ = std::make_unique<CloudInput>(node_, tf_buffer_, options_.frames, options_.cloud,
                                         options_.localizer.motion.prior, std::move(callbacks));
  map_source_ = std::make_unique<MapSource>(
      node_, options_.map, options_.localizer.registration,
      [this](LoadedMap map) { putMapIntoUse(std::move(map)); },
      [this](const std::string& message) {
        ROS_ERROR_STREAM_NAMED(name_, message);
        announce(std_msgs::Header(), Status::REASON_NO_MAP, message);
      });
  if (gravity_.wantsImu()) {
    imu_subscriber_ = node_.subscribe<sensor_msgs::Imu>(
        "imu", 50, [this](const sensor_msgs::ImuConstPtr& imu) { gravity_.add(*imu); });
  }
  initial_pose_subscriber_ = node_.subscribe("initialpose", 2, &LocalizationRos::onInitialPose, this);
}

void LocalizationRos::startTimers() {
  // Wall timers: the clock may stand still or jump, and the watch has to notice.
  tf_timer_ =
      node_.createWallTimer(ros::WallDuration(1.0 / options_.frames.tf_rate),
                            [this](const ros::WallTimerEvent&) { tf_output_.tick(ros::Time::now()); });
  watch_timer_ =
      node_.createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) { watch(); });
}

bool LocalizationRos::onArrived(const std_msgs::Header& header) {
  const ros::Time now = ros::Time::now();
  if (clock_watch_.clockJumped(now)) timeJumpedBack("the clock went back");
  // Without simulated time a looping bag shows in the stamps only; a stamp ahead of the clock is refused
  // elsewhere.
  if (header.stamp <= now && clock_watch_.stampsJumped(header.stamp))
    timeJumpedBack("the clouds' stamps went back");
  return !paused_;
}

void LocalizationRos::onReady(const boost::shared_ptr<const CloudScan>& cloud, bool odometry) {
  int epoch;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    epoch = epoch_;
  }
  // The message filter hands out what waited for the same transform in any order.
  const auto newer = [](const ReadyScan& scan, const ReadyScan& waiting) {
    return scan.epoch != waiting.epoch || scan.cloud->header.stamp > waiting.cloud->header.stamp;
  };
  if (scans_.put({cloud, odometry, epoch}, newer)) ++dropped_;
}

void LocalizationRos::runRegistration() {
  while (const std::optional<ReadyScan> ready = scans_.take()) {
    try {
      process(*ready);
    } catch (const std::exception& error) {
      refuse(ready->cloud->header, Status::REASON_BAD_CLOUD, error.what());
    }
  }
}

void LocalizationRos::process(const ReadyScan& ready) {
  SeenScan seen;
  seen.header = ready.cloud->header;
  seen.taken = ros::WallTime::now();
  try {
    seen.scan = withTransforms(*ready.cloud, ready.odometry, tf_buffer_, options_.frames,
                               options_.localizer.motion.prior);
  } catch (const std::exception& error) {  // none, or one that is no rigid motion
    refuse(seen.header, Status::REASON_NO_TRANSFORM, error.what());
    return;
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  if (ready.epoch != epoch_) return;
  addOdometryToPose();
  LocalizationUpdate update = localizer_.process(seen.scan);
  if (update.reason == RefusalReason::kOldStamp) return;  // overtaken while it waited for its transforms
  if (!ready.odometry)
    update.message += (update.message.empty() ? "" : "; ") + std::string("odometry is missing");
  newest_scan_ = std::move(seen);
  publishUpdate(update, *newest_scan_);
  if (update.wants_global) startGlobal(*newest_scan_);
}

void LocalizationRos::publishUpdate(const LocalizationUpdate& update, const SeenScan& seen) {
  const ros::Time stamp = seen.header.stamp;
  const bool in_use = update.state == LocalizerState::kTracking || update.state == LocalizerState::kDegraded;
  if (update.pose_valid) {
    output_.publish(update, seen.scan.points, stamp);
    pose_since_global_ = output_.poseMessage(update, stamp);
  }
  if (!in_use) {
    tf_output_.stop();
  } else if (update.pose_valid && options_.frames.tf_broadcast) {
    if (options_.frames.odom_frame_id.empty()) {
      tf_output_.update(update.T_map_base, update.twist, stamp, ros::Time::now());
    } else if (seen.scan.T_odom_base && update.T_map_odom) {
      tf_output_.update(*update.T_map_odom, Vector6d::Zero(), stamp, ros::Time::now());
    }
  }
  if (!update.pose_valid) ++refused_;
  publishStatus(toStatus(update), seen.header);
}

void LocalizationRos::publishStatus(Status status, const std_msgs::Header& header) {
  status.header.stamp = header.stamp;
  status.header.frame_id = options_.frames.global_frame_id;
  status.map_id = map_id_;
  if (!header.stamp.isZero()) status.latency = (ros::Time::now() - header.stamp).toSec();
  status.progress = global_worker_->running() ? global_worker_->progress() : 0.0;
  status.scans = clouds_ ? clouds_->counts().received : 0;
  status.refused = refused_;
  status.dropped = dropped_;
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

void LocalizationRos::refuse(const std_msgs::Header& header, std::uint8_t reason,
                             const std::string& message) {
  ROS_WARN_STREAM_THROTTLE_NAMED(5.0, name_, name_ << ": " << message);
  announce(header, reason, message);
}

void LocalizationRos::announce(const std_msgs::Header& header, std::uint8_t reason,
                               const std::string& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (reason == Status::REASON_BAD_CLOUD || reason == Status::REASON_NO_TRANSFORM) ++refused_;
  Status status;
  status.state = statusState(localizer_.state());
  status.reason = reason;
  status.message = message;
  publishStatus(std::move(status), header);
}

void LocalizationRos::putMapIntoUse(LoadedMap map) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (map.frame_id != options_.frames.global_frame_id) {
    ROS_INFO_STREAM_NAMED(name_, name_ << ": the map calls its frame '" << map.frame_id
                                       << "', it is used as '" << options_.frames.global_frame_id << "'");
  }
  ROS_INFO_STREAM_NAMED(name_, name_ << ": " << map.summary);
  localizer_.setMap(std::move(map.map));
  ++orders_;
  map_id_ = map.map_id;
  map_summary_ = map.summary;
  map_message_ = std::move(map.message);
  Status status;
  status.state = statusState(localizer_.state());
  status.message = "map " + map_id_ + " is in use" + whatIsAwaited();
  publishStatus(std::move(status), std_msgs::Header());
}

std::string LocalizationRos::whatIsAwaited() const {
  if (localizer_.state() != LocalizerState::kWaitingForPose &&
      localizer_.state() != LocalizerState::kRelocalizing)
    return {};
  std::string text;
  if (localizer_.state() == LocalizerState::kWaitingForPose) {
    text = options_.localizer.recovery.start_globally
               ? "; a global localization starts with the first cloud"
               : "; waiting for a pose: initialpose, ~relocalize or ~global_localization";
  }
  if (clouds_ && !newest_scan_) {
    const std::string why = clouds_->whyWaiting();
    text += "; waiting for clouds on '" + clouds_->topic() + "' and their transforms" + why;
  }
  return text;
}

void LocalizationRos::applyLive(const LocalizationRosOptions& options) {
  clouds_->setCloudOptions(options.cloud);
  tf_output_.setTiming(options.frames.transform_tolerance, options.frames.tf_rate);
  tf_timer_.setPeriod(ros::WallDuration(1.0 / options.frames.tf_rate));
  quiet_limit_ = options.output.quiet_warning_seconds;
  const std::lock_guard<std::mutex> lock(mutex_);
  localizer_.setOptions(options.localizer);
}

ros::Publisher publishRefusal(ros::NodeHandle node, const std::string& message) {
  ros::Publisher publisher = node.advertise<ttsdf_localization::LocalizationStatus>("status", 1, true);
  ttsdf_localization::LocalizationStatus status;
  status.header.stamp = ros::Time::now();
  status.state = ttsdf_localization::LocalizationStatus::ERROR;
  status.state_name = statusStateName(status.state);
  status.reason = ttsdf_localization::LocalizationStatus::REASON_PARAMETER;
  status.message = message;
  publisher.publish(status);
  return publisher;
}

}  // namespace ttsdf
