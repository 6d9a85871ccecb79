#include "ros/scans/scan_localizer.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "ros/messages/conversions.h"
#include "ros/messages/stamps.h"
#include "ros/scans/transform_buffer.h"
#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

namespace {
constexpr double kLongestInterval = 5.0;  // [s] between scans that belong together
constexpr double kIntervalGain = 0.2;
constexpr int kOldTransforms = 5;  // in a row: a time jump that no clock shows
constexpr double kRateSlack =
    0.9;  // a camera of 30 Hz and max_rate 10: every third scan, whatever the jitter

ScanQueue::Options queueOptions(const LocalizationRosOptions& options) {
  ScanQueue::Options queue;
  queue.targets = {options.frames.base_frame_id};
  if (options.localizer.motion.prior == "external") queue.targets.push_back(options.frames.global_frame_id);
  queue.odometry = options.frames.odom_frame_id;
  queue.odometry_timeout = options.frames.odometry_timeout;
  queue.size = static_cast<std::size_t>(options.frames.tf_queue_size);
  return queue;
}

Eigen::Isometry3d lookUp(const tf2::BufferCore& buffer, const std::string& target, const std::string& source,
                         const ros::Time& stamp) {
  return fromMessage(buffer.lookupTransform(target, source, stamp).transform);
}
}  // namespace

ScanLocalizer::ScanLocalizer(const LocalizationRosOptions& options)
    : frames_(options.frames),
      update_(options.update),
      external_prior_(options.localizer.motion.prior == "external"),
      queue_(queueOptions(options), buffer_),
      gravity_(options.gravity, options.frames, buffer_),
      localizer_(options.localizer) {}

TransformsOutcome ScanLocalizer::addTransforms(const tf2_msgs::TFMessage& message,
                                               const std::string& authority, bool is_static,
                                               const ros::Time& now) {
  TransformsOutcome outcome;
  for (const auto& transform : message.transforms) {
    AddedTransform added = addTransform(buffer_, transform, authority, is_static, now);
    if (!added.left_out.empty()) {
      ++outcome.left_out;
      outcome.why = std::move(added.left_out);
      continue;
    }
    if (is_static) continue;
    int& rejected = old_transforms_[transform.child_frame_id];
    rejected = added.taken ? 0 : rejected + 1;
    outcome.jumped_back = outcome.jumped_back || (rejected >= kOldTransforms && isTooOld(transform));
  }
  if (outcome.jumped_back) old_transforms_.clear();
  return outcome;
}

bool ScanLocalizer::isTooOld(const geometry_msgs::TransformStamped& transform) const {
  try {
    const ros::Time newest =
        buffer_.lookupTransform(transform.header.frame_id, transform.child_frame_id, ros::Time(0))
            .header.stamp;
    return secondsBetween(transform.header.stamp, newest) > 1.0;
  } catch (const std::exception&) {
    return false;  // refused for another reason: NaN, say
  }
}

std::optional<ScanOutcome> ScanLocalizer::next(const ros::Time& now, bool newest, bool at_end) {
  std::optional<ScanQueue::Taken> taken = queue_.take(now, newest, at_end);
  if (!taken) return std::nullopt;
  ScanOutcome outcome;
  outcome.header = taken->scan.header;
  if (taken->overtaken) {
    outcome.kind = ScanOutcome::Kind::kOvertaken;
    return outcome;
  }
  outcome.kind = ScanOutcome::Kind::kRejected;
  outcome.message = taken->missing;
  if (!taken->missing.empty()) return outcome;
  try {
    outcome.scan = withTransforms(taken->scan, !taken->without_odometry);
  } catch (const std::exception& error) {  // forgotten meanwhile, or one that is no rigid motion
    outcome.message = error.what();
    return outcome;
  }
  const double interval = outcome.scan.stamp - last_stamp_;
  if (interval > 0.0 && interval < kLongestInterval) {
    usual_interval_ += (usual_interval_ > 0.0 ? kIntervalGain : 1.0) * (interval - usual_interval_);
  }
  last_stamp_ = outcome.scan.stamp;
  if (pose_request_) {
    // Only now: when the pose came in, the odometry of its stamp may not have been there yet.
    localizer_.setGuess(withOdometry(*pose_request_, buffer_, frames_));
    pose_request_.reset();
  } else if (mayBeSkipped(outcome.scan)) {
    silence_ = 0.0;
    outcome.kind = ScanOutcome::Kind::kSkipped;
    return outcome;
  }
  outcome.update = localizer_.process(outcome.scan);
  if (outcome.update.reason == RejectionReason::kOldStamp) {
    outcome.kind = ScanOutcome::Kind::kOld;
    return outcome;
  }
  outcome.kind = ScanOutcome::Kind::kLocalized;
  if (outcome.update.pose_valid) noteUsed(outcome.scan);
  if (taken->without_odometry) {
    outcome.update.message +=
        (outcome.update.message.empty() ? "" : "; ") + std::string("odometry is missing");
  }
  return outcome;
}

void ScanLocalizer::advanceTime(double seconds) { silence_ += std::max(0.0, seconds); }

std::optional<LocalizationUpdate> ScanLocalizer::checkSilence() {
  return localizer_.withoutScans(silence_, usual_interval_);
}

void ScanLocalizer::usePose(PoseRequest request) {
  localizer_.setGuess(request.guess);
  pose_request_ = std::move(request);
}

void ScanLocalizer::reset() {
  pose_request_.reset();
  last_used_stamp_.reset();
  T_odom_base_used_.reset();
  queue_.clear();
  localizer_.reset();
}

void ScanLocalizer::timeJumpedBack() {
  buffer_.clear();
  queue_.clear();
  last_stamp_ = silence_ = 0.0;
  last_used_stamp_.reset();
  T_odom_base_used_.reset();
  if (pose_request_) pose_request_->stamp = ros::Time();
  localizer_.timeJumpedBack();
}

void ScanLocalizer::setOptions(const LocalizationRosOptions& options) {
  localizer_.setOptions(options.localizer);
  update_ = options.update;
}

LocalizerScan ScanLocalizer::withTransforms(const QueuedScan& scan, bool odometry) const {
  LocalizerScan result;
  const ros::Time stamp = scan.header.stamp;
  result.stamp = stamp.toSec();
  result.points = scan.points;
  result.T_base_sensor = lookUp(buffer_, frames_.base_frame_id, scan.header.frame_id, stamp);
  if (odometry && !frames_.odom_frame_id.empty())
    result.T_odom_base = lookUp(buffer_, frames_.odom_frame_id, frames_.base_frame_id, stamp);
  if (external_prior_)
    result.T_map_base_prior = lookUp(buffer_, frames_.global_frame_id, frames_.base_frame_id, stamp);
  return result;
}

bool ScanLocalizer::mayBeSkipped(const LocalizerScan& scan) const {
  if (update_requested_ || localizer_.state() != LocalizerState::kTracking || !last_used_stamp_) return false;
  if (update_.max_rate > 0.0 && scan.stamp - *last_used_stamp_ < kRateSlack / update_.max_rate) return true;
  if (update_.update_min_d <= 0.0 && update_.update_min_a <= 0.0) return false;
  if (!scan.T_odom_base || !T_odom_base_used_) return false;
  const PoseError motion = poseError(*T_odom_base_used_, *scan.T_odom_base);
  return !(update_.update_min_d > 0.0 && motion.translation >= update_.update_min_d) &&
         !(update_.update_min_a > 0.0 && motion.rotation >= update_.update_min_a);
}

void ScanLocalizer::noteUsed(const LocalizerScan& scan) {
  silence_ = 0.0;
  update_requested_ = false;
  last_used_stamp_ = scan.stamp;
  T_odom_base_used_ = scan.T_odom_base;
}

}  // namespace ttsdf
