#include "ros/node/localization_ros.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "ros/messages/conversions.h"
#include "ros/messages/stamps.h"
#include "ros/poses/pose_store.h"

namespace ttsdf {

namespace {
constexpr double kWatchPeriod = 0.2;         // [s]
constexpr double kTransformPatience = 1.0;   // [s] that scans may wait for transforms without a word
constexpr double kShortestTfPeriod = 0.005;  // [s] of wall time, when simulated time runs fast
constexpr double kSlowdown = 0.8;            // of simulated time, at the most, from one look to the next
constexpr double kTfPeriodSlack = 0.1;       // a timer that is set anew begins anew

ros::NodeHandle onQueue(ros::NodeHandle node, ros::CallbackQueue& queue) {
  node.setCallbackQueue(&queue);
  return node;
}
}  // namespace

LocalizationRos::LocalizationRos(const ros::NodeHandle& node, const ros::NodeHandle& private_node,
                                 const std::string& name)
    : name_(name),
      scan_node_(onQueue(node, scan_queue_)),
      transform_node_(onQueue(node, transform_queue_)),
      watch_node_(onQueue(node, watch_queue_)),
      service_node_(onQueue(private_node, service_queue_)),
      options_(loadLocalizationOptions(private_node)),
      pipeline_(watch_node_, options_, name),
      diagnostics_(node, private_node, name),
      pose_saver_(options_.start.pose_file, options_.frames.global_frame_id),
      quiet_limit_(options_.output.quiet_warning_seconds),
      tf_rate_(options_.frames.tf_rate),
      started_(ros::WallTime::now()),
      last_pose_saved_(started_),
      last_look_(started_) {
  private_node.param("diagnostic_period", diagnostic_period_, diagnostic_period_);
  // Latched: who asks before the first map and scan is told what the node waits for.
  pipeline_.publishEvent(Status::REASON_NO_MAP,
                         "started; waiting for a map (map_source: " + options_.map.map_source + ")");
  if (std::optional<PoseRequest> start = poseAtStart()) pipeline_.usePose(std::move(*start));
  subscribe();
  advertise();
  startTimers();
  live_parameters_ = std::make_unique<LiveParameters>(
      service_node_, options_, [this](const LocalizationRosOptions& options) { applyLive(options); });
  const std::pair<ros::CallbackQueue*, int> threads[] = {
      {&scan_queue_, 1}, {&transform_queue_, 1}, {&watch_queue_, 1}, {&service_queue_, 4}};
  for (const auto& [queue, count] : threads)
    threads_.push_back(std::make_unique<QueueThreads>(*queue, count));
}

LocalizationRos::~LocalizationRos() {
  // From the outside in: first nothing comes in any more, then what runs ends, then the rest goes.
  pipeline_.stop();  // a caller that waits for a pose keeps its service busy
  for (ros::ServiceServer& service : services_) service.shutdown();
  live_parameters_->shutdown();
  initial_pose_subscriber_.shutdown();
  imu_subscriber_.shutdown();
  transforms_->shutdown();
  tf_timer_.stop();
  watch_timer_.stop();
  threads_.clear();
  scans_.reset();
  map_source_.reset();
  if (atlas_source_) atlas_source_->stop();
  pipeline_.setWiderSearch({});  // it uses the source
  atlas_source_.reset();
  if (std::optional<PoseGuess> pose = pipeline_.trackedPose()) pose_saver_.put(std::move(*pose));
}

void LocalizationRos::subscribe() {
  transforms_ = std::make_unique<TransformInput>(
      transform_node_,
      [this](const tf2_msgs::TFMessage& message, const std::string& authority, bool is_static) {
        checkClock();
        pipeline_.addTransforms(message, authority, is_static);
      });
  ScanInput::Callbacks callbacks;
  callbacks.arrived = [this] {
    checkClock();
    pipeline_.noteArrival();
    return !paused_;
  };
  callbacks.time_jumped_back = [this](const std::string& why) { pipeline_.timeJumpedBack(why); };
  callbacks.ready = [this](QueuedScan scan) { pipeline_.addScan(std::move(scan)); };
  callbacks.rejected = [this](const std_msgs::Header& header, const std::string& message) {
    pipeline_.rejectScan(header, message);
  };
  scans_ = std::make_unique<ScanInput>(scan_node_, options_.input, options_.cloud, std::move(callbacks));
  const auto loaded = [this](LoadedMap map) { pipeline_.useMap(std::move(map)); };
  const auto failed = [this](const std::string& message) {
    ROS_ERROR_STREAM_NAMED(name_, message);
    pipeline_.publishEvent(Status::REASON_NO_MAP, message);
  };
  map_source_ =
      std::make_unique<MapSource>(scan_node_, options_.map, options_.localizer.registration, loaded, failed);
  if (options_.map.map_source == "atlas" || options_.map.map_source == "atlas_server") {
    try {
      atlas_source_ =
          std::make_unique<AtlasSource>(scan_node_, options_.map, options_.localizer, loaded, failed);
      pipeline_.setWiderSearch(
          {[this](const LocalizerScan& scan, const std::optional<Eigen::Vector3d>& gravity, bool goes_on,
                  const ProgressCallback& progress) {
             return atlas_source_->find(scan, gravity, goes_on, progress);
           },
           [this](const Eigen::Vector3d& place, const ProgressCallback& progress) {
             return atlas_source_->loadAround(place, progress);
           },
           [this] { return atlas_source_->remark(); }, [this] { return atlas_source_->mayGoOn(); },
           [this] { atlas_source_->forgetScans(); }});
    } catch (const std::exception& error) {
      failed(error.what());  // as of a map file that cannot be read
    }
  }
  if (pipeline_.gravity().wantsImu()) {
    imu_subscriber_ =
        scan_node_.subscribe<sensor_msgs::Imu>("imu", 50, [this](const sensor_msgs::ImuConstPtr& imu) {
          const std::string left_out = pipeline_.gravity().add(*imu, ros::Time::now());
          if (!left_out.empty()) {
            ROS_WARN_STREAM_THROTTLE_NAMED(5.0, name_,
                                           name_ << ": a message of the IMU was left out: " << left_out);
          }
        });
  }
  initial_pose_subscriber_ = scan_node_.subscribe("initialpose", 2, &LocalizationRos::onInitialPose, this);
}

void LocalizationRos::startTimers() {
  // Wall timers: the clock may stand still or jump, and the watch has to notice.
  tf_timer_ = transform_node_.createWallTimer(
      ros::WallDuration(tf_period_), [this](const ros::WallTimerEvent&) { pipeline_.sendTransform(); });
  watch_timer_ = watch_node_.createWallTimer(ros::WallDuration(kWatchPeriod),
                                             [this](const ros::WallTimerEvent&) { watch(); });
}

void LocalizationRos::applyLive(const LocalizationRosOptions& options) {
  scans_->setCloudOptions(options.cloud);
  tf_rate_ = options.frames.tf_rate;
  quiet_limit_ = options.output.quiet_warning_seconds;
  pipeline_.setOptions(options);
}

std::optional<PoseRequest> LocalizationRos::poseAtStart() {
  std::optional<PoseRequest> request;
  if (options_.start.set_initial_pose) request = startPose(options_.start);
  if (options_.start.pose_file.empty()) return request;
  try {
    if (std::optional<PoseGuess> saved =
            loadPose(options_.start.pose_file, options_.frames.global_frame_id)) {
      const bool both = request.has_value();
      request = PoseRequest{std::move(*saved), ros::Time(), ""};
      request->guess.source = "saved pose of " + options_.start.pose_file;
      if (both) request->warning = "initial_pose_* is for the first start only: pose_file has a later pose";
    }
  } catch (const std::exception& error) {
    ROS_ERROR_STREAM_NAMED(name_, name_ << ": " << error.what());
  }
  return request;
}

void LocalizationRos::onInitialPose(const geometry_msgs::PoseWithCovarianceStampedConstPtr& message) {
  try {
    PoseRequest request =
        readPose(*message, pipeline_.buffer(), options_.frames, "initialpose", ros::Time::now());
    if (!request.warning.empty()) ROS_WARN_STREAM_NAMED(name_, name_ << ": " << request.warning);
    pipeline_.usePose(std::move(request));
  } catch (const std::exception& error) {
    const std::string text = std::string("initialpose refused: ") + error.what();
    ROS_ERROR_STREAM_NAMED(name_, name_ << ": " << text);
    pipeline_.publishEvent(Status::REASON_NO_START_POSE, text);
  }
}

void LocalizationRos::checkClock() {
  const std::lock_guard<std::mutex> lock(clock_mutex_);
  if (clock_.clockJumpedBack(ros::Time::now())) pipeline_.timeJumpedBack("the clock went back");
}

/// `tf_rate` counts in the clock of the stamps, and simulated time may run ten times as fast as time does.
void LocalizationRos::adjustTfTimer() {
  const double usual = 1.0 / tf_rate_, shortest = std::min(kShortestTfPeriod, usual);
  double period = usual;
  if (ros::Time::isSimTime()) {
    const ros::Time clock = ros::Time::now();
    const ros::WallTime now = ros::WallTime::now();
    const double speed = secondsBetween(last_clock_, clock) / std::max((now - last_look_).toSec(), 1e-3);
    last_clock_ = clock;
    last_look_ = now;
    period = std::max(shortest, std::min(usual / std::max(speed, 1.0), tf_period_ / kSlowdown));
  }
  if (std::abs(period - tf_period_) < kTfPeriodSlack * tf_period_) return;
  tf_period_ = period;
  tf_timer_.setPeriod(ros::WallDuration(period));
}

void LocalizationRos::watch() {
  try {
    checkClock();
    adjustTfTimer();
    const std::string waiting = paused_ ? std::string() : warnWhenQuiet(pipeline_.view().scans);
    pipeline_.tick(waiting);
    if (atlas_source_) {
      if (const auto place = pipeline_.robotPosition()) {
        atlas_source_->want(*place);
      } else {
        atlas_source_->wantAny();
      }
      diagnostics_.setAtlas(atlas_source_->status());
    }
    const LocalizationPipeline::View view = pipeline_.view();
    const ros::WallTime now = ros::WallTime::now();
    const std::string diagnosed = view.status.state_name + (view.tf_sent ? " sent" : " silent");
    if (diagnosed != diagnosed_ || (now - last_diagnostics_).toSec() >= diagnostic_period_) {
      diagnosed_ = diagnosed;
      last_diagnostics_ = now;
      diagnostics_.update(view, scans_->topic(), quiet_limit_, waiting);
    }
    if ((now - last_pose_saved_).toSec() < options_.start.save_pose_period) return;
    last_pose_saved_ = now;
    if (std::optional<PoseGuess> pose = pipeline_.trackedPose()) pose_saver_.put(std::move(*pose));
  } catch (const std::exception& error) {
    ROS_ERROR_STREAM_THROTTLE_NAMED(5.0, name_, name_ << ": " << error.what());
  }
}

std::string LocalizationRos::warnWhenQuiet(const ScanCounts& scans) {
  const ros::WallTime now = ros::WallTime::now();
  const double limit = quiet_limit_;
  const double quiet = (now - std::max(started_, scans.last_arrival)).toSec();
  const double stuck = (now - std::max(started_, scans.last_taken)).toSec();
  const bool may_warn = (now - last_quiet_warning_).toSec() >= limit;
  if (quiet >= limit) {
    if (!may_warn) return {};
    last_quiet_warning_ = now;
    ROS_WARN_STREAM_NAMED(name_,
                          name_ << ": no cloud on '" << scans_->topic() << "' for " << static_cast<int>(quiet)
                                << " s. Is the camera running, and is the topic remapped? With depth "
                                   "images instead of clouds: depth_image:=true of localization.launch.");
    return {};
  }
  if (scans.received == 0 || stuck < std::min(limit, kTransformPatience)) return {};
  const std::string why = pipeline_.whyWaiting();
  if (why.empty()) return {};
  const std::string text = "scans wait for their transforms" + why;
  if (may_warn && stuck >= limit) {
    last_quiet_warning_ = now;
    ROS_WARN_STREAM_NAMED(name_, name_ << ": " << text);
  }
  return text;
}

ros::Publisher publishStartError(ros::NodeHandle node, const std::string& message) {
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
