#include "ttsdf_localization/ros/bag_localizer.h"

#include <exception>
#include <utility>

#include "ttsdf_localization/ros/conversions.h"
#include "ttsdf_localization/ros/localization_output.h"
#include "ttsdf_localization/ros/pose_store.h"

namespace ttsdf {

namespace {
constexpr double kNoTimeLimit = 3600.0;  // [s] the most the options allow
constexpr double kPatience = 1.0;        // [s] of the bag that a scan waits for its transforms

LocalizerOptions withoutTimeLimit(LocalizerOptions options) {
  options.global.max_seconds = kNoTimeLimit;
  return options;
}
}  // namespace

BagLocalizer::BagLocalizer(const LocalizationRosOptions& options, PreparedMap map, Report report)
    : options_(options),
      report_(std::move(report)),
      gravity_(options_.gravity, options_.frames, buffer_),
      localizer_(withoutTimeLimit(options_.localizer)) {
  localizer_.setMap(std::move(map));
  if (options_.start.set_initial_pose) pose_request_ = startPose(options_.start);
  if (options_.start.pose_file.empty()) return;
  if (std::optional<PoseGuess> saved = loadPose(options_.start.pose_file, options_.frames.global_frame_id)) {
    pose_request_ = PoseRequest{std::move(*saved), ros::Time(), ""};
  }
}

void BagLocalizer::add(const tf2_msgs::TFMessage& transforms, bool is_static) {
  for (const auto& transform : transforms.transforms) buffer_.setTransform(transform, "bag", is_static);
}

void BagLocalizer::add(const geometry_msgs::PoseWithCovarianceStamped& initial_pose) {
  try {
    pose_request_ = readPose(initial_pose, buffer_, options_.frames, "initialpose");
    localizer_.setGuess(pose_request_->guess);
  } catch (const std::exception& error) {
    warnings_.push_back(std::string("initialpose refused: ") + error.what());
  }
}

void BagLocalizer::add(const sensor_msgs::PointCloud2& cloud) {
  CloudScan scan;
  scan.header = cloud.header;
  scan.header.frame_id = withoutLeadingSlash(cloud.header.frame_id);
  if (clock_watch_.stampsJumped(cloud.header.stamp)) timeJumpedBack();
  try {
    if (scan.header.frame_id.empty()) throw std::invalid_argument("the cloud has no frame_id");
    if (scan.header.stamp.isZero()) {
      throw std::invalid_argument("the cloud has stamp 0: no transform can be looked up for it");
    }
    scan.points = convertCloud(cloud, options_.cloud).points;
  } catch (const std::exception& error) {
    refuse(scan.header, Status::REASON_BAD_CLOUD, error.what());
    return;
  }
  waiting_.push_back({std::move(scan), now_});
}

void BagLocalizer::addDamaged(const std_msgs::Header& header, const std::string& why) {
  refuse(header, Status::REASON_BAD_CLOUD, why);
}

void BagLocalizer::advance(const ros::Time& time) {
  now_ = time;
  while (!waiting_.empty() && tryFirst(false)) waiting_.pop_front();
}

void BagLocalizer::finish() {
  while (!waiting_.empty()) {
    tryFirst(true);
    waiting_.pop_front();
  }
}

BagLocalizer::Transforms BagLocalizer::transformsOf(const CloudScan& scan, std::string& why) const {
  const FrameOptions& frames = options_.frames;
  const auto there = [&](const std::string& target) {
    return buffer_.canTransform(target, scan.header.frame_id, scan.header.stamp, &why);
  };
  if (!there(frames.base_frame_id)) return Transforms::kMissing;
  if (options_.localizer.motion.prior == "external" && !there(frames.global_frame_id))
    return Transforms::kMissing;
  if (!frames.odom_frame_id.empty() && !there(frames.odom_frame_id)) return Transforms::kAllButOdometry;
  return Transforms::kAll;
}

bool BagLocalizer::tryFirst(bool at_end) {
  const Waiting& first = waiting_.front();
  std::string why;
  const Transforms transforms = transformsOf(first.scan, why);
  if (transforms == Transforms::kAll) {
    odometry_seen_ = true;
    process(first.scan, true);
    return true;
  }
  const double waited = (now_ - first.arrival).toSec();
  // As in the node: a drop-out is bridged, odometry that never was there is a mistake in the set-up.
  const bool may_bridge =
      transforms == Transforms::kAllButOdometry && odometry_seen_ && options_.frames.odometry_timeout > 0.0;
  if (may_bridge && (at_end || waited >= options_.frames.odometry_timeout)) {
    process(first.scan, false);
    return true;
  }
  if (!at_end && waited < kPatience) return false;
  refuse(first.scan.header, Status::REASON_NO_TRANSFORM, "its transforms did not come in time: " + why);
  return true;
}

void BagLocalizer::process(const CloudScan& scan, bool odometry) {
  LocalizerScan with;
  try {
    with = withTransforms(scan, odometry, buffer_, options_.frames, options_.localizer.motion.prior);
  } catch (const std::exception& error) {  // none, or one that is no rigid motion
    refuse(scan.header, Status::REASON_NO_TRANSFORM, error.what());
    return;
  }
  if (pose_request_) localizer_.setGuess(withOdometry(*pose_request_, buffer_, options_.frames));
  pose_request_.reset();
  LocalizationUpdate update = localizer_.process(with);
  if (!odometry) update.message += (update.message.empty() ? "" : "; ") + std::string("odometry is missing");
  report_(scan.header, toStatus(update), update);
  if (update.wants_global) runGlobal(with, scan.header);
}

void BagLocalizer::runGlobal(const LocalizerScan& scan, const std_msgs::Header& header) {
  ++globals_;
  GlobalJob job = localizer_.beginGlobal(scan, gravity_.down(header.frame_id, header.stamp));
  job.run();
  localizer_.finishGlobal(job);
}

void BagLocalizer::refuse(const std_msgs::Header& header, std::uint8_t reason, const std::string& message) {
  LocalizationUpdate update;
  update.stamp = header.stamp.toSec();
  update.state = localizer_.state();
  Status status = toStatus(update);
  status.reason = reason;
  status.message = message;
  report_(header, status, update);
}

void BagLocalizer::timeJumpedBack() {
  finish();
  buffer_.clear();
  odometry_seen_ = false;
  if (pose_request_) pose_request_->stamp = ros::Time();
  localizer_.timeJumpedBack();
}

}  // namespace ttsdf
