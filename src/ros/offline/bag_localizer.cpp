#include "ros/offline/bag_localizer.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <utility>

#include "ros/messages/conversions.h"
#include "ros/messages/stamps.h"
#include "ros/node/localization_output.h"
#include "ros/poses/pose_store.h"

namespace ttsdf {

namespace {
constexpr char kBagTime[] = "by the bag's time, ";
constexpr double kLongestStep = 1.0;  // [s] between two messages: a longer gap of the bag is no silent camera
}  // namespace

BagLocalizer::BagLocalizer(const LocalizationRosOptions& options, PreparedMap map, Report report)
    : options_(options), report_(std::move(report)), localizer_(options_) {
  localizer_.localizer().setMap(std::move(map));
  if (options_.start.set_initial_pose) localizer_.usePose(startPose(options_.start));
  if (options_.start.pose_file.empty()) return;
  if (std::optional<PoseGuess> saved = loadPose(options_.start.pose_file, options_.frames.global_frame_id)) {
    localizer_.usePose(PoseRequest{std::move(*saved), ros::Time(), ""});
    if (options_.start.set_initial_pose)
      warnings_.push_back("initial_pose_* is for the first start only: pose_file has a later pose");
  }
}

void BagLocalizer::add(const tf2_msgs::TFMessage& transforms, bool is_static) {
  const TransformsOutcome outcome = localizer_.addTransforms(transforms, "bag", is_static, now_);
  if (outcome.left_out > 0) {
    transforms_left_out_.count += outcome.left_out;
    transforms_left_out_.why = outcome.why;
  }
  if (!outcome.jumped_back) return;
  timeJumpedBack();
  localizer_.addTransforms(transforms, "bag", is_static, now_);
}

void BagLocalizer::add(const sensor_msgs::Imu& imu) {
  const std::string left_out = localizer_.gravity().add(imu, now_);
  if (left_out.empty()) return;
  ++imu_left_out_.count;
  imu_left_out_.why = left_out;
}

void BagLocalizer::add(const geometry_msgs::PoseWithCovarianceStamped& initial_pose) {
  try {
    PoseRequest request = readPose(initial_pose, localizer_.buffer(), options_.frames, "initialpose", now_);
    if (!request.warning.empty()) warnings_.push_back(request.warning);
    localizer_.usePose(std::move(request));
  } catch (const std::exception& error) {
    warnings_.push_back(std::string("initialpose refused: ") + error.what());
  }
}

void BagLocalizer::add(const std_msgs::Header& header,
                       const std::function<ConvertedCloud(const CloudOptions&)>& convert) {
  QueuedScan scan;
  scan.header = header;
  scan.header.frame_id = withoutLeadingSlash(header.frame_id);
  const std::string problem = stampProblem(header.stamp, now_);
  if (!problem.empty()) return reject(scan.header, Status::REASON_BAD_CLOUD, kBagTime + problem);
  if (clock_watch_.stampsJumpedBack(header.stamp)) timeJumpedBack();
  try {
    if (scan.header.frame_id.empty()) throw std::invalid_argument("the scan has no frame_id");
    if (scan.header.stamp.isZero())
      throw std::invalid_argument("the scan has stamp 0: no transform can be looked up for it");
    ConvertedCloud converted = convert(options_.cloud);
    if (converted.wrong_byte_order) ++scans_of_wrong_byte_order_;
    if (converted.points.cols() == 0) {
      ++scans_without_points_;
      if (converted.not_finite > converted.out_of_range) ++scans_without_readings_;
    }
    scan.points = std::move(converted.points);
  } catch (const std::exception& error) {
    reject(scan.header, Status::REASON_BAD_CLOUD, error.what());
    return;
  }
  localizer_.queue().put(std::move(scan), now_);
}

void BagLocalizer::advance(const ros::Time& time) {
  const double seconds = now_.isZero() ? 0.0 : secondsBetween(now_, time);
  now_ = time;
  localizer_.advanceTime(std::clamp(seconds, 0.0, kLongestStep));
  processScans(false);
  localizer_.checkSilence();
}

void BagLocalizer::processRemaining() { processScans(true); }

std::vector<std::string> BagLocalizer::warnings() const {
  std::vector<std::string> all = warnings_;
  if (scans_without_points_ > 0) {
    all.push_back(std::to_string(scans_without_points_) + " scans have no point between " +
                  toString(options_.cloud.min_range) + " and " + toString(options_.cloud.max_range) +
                  " m (min_range, max_range)" +
                  (scans_without_readings_ > 0 ? "; most of " + std::to_string(scans_without_readings_) +
                                                     " of them is no reading at all"
                                               : ""));
  }
  if (scans_of_wrong_byte_order_ > 0) {
    all.push_back("is_bigendian of " + std::to_string(scans_of_wrong_byte_order_) +
                  " clouds is wrong, they are read the other way round");
  }
  const auto addLeftOut = [&all](const LeftOut& left_out, const std::string& what) {
    if (left_out.count == 0) return;
    all.push_back("left out: " + std::to_string(left_out.count) + " " + what + "; the last one: " + kBagTime +
                  left_out.why);
  };
  addLeftOut(transforms_left_out_, "transforms of tf");
  addLeftOut(imu_left_out_, "messages of the IMU");
  return all;
}

void BagLocalizer::processScans(bool at_end) {
  while (const std::optional<ScanOutcome> outcome = localizer_.next(now_, false, at_end)) report(*outcome);
}

void BagLocalizer::report(const ScanOutcome& outcome) {
  switch (outcome.kind) {
    case ScanOutcome::Kind::kRejected:
      return reject(outcome.header, Status::REASON_NO_TRANSFORM, outcome.message);
    case ScanOutcome::Kind::kOvertaken:
      return reject(outcome.header, Status::REASON_OLD_STAMP, "the scan was overtaken by newer ones");
    case ScanOutcome::Kind::kOld:
      return reject(outcome.header, statusReason(outcome.update.reason), outcome.update.message);
    case ScanOutcome::Kind::kSkipped:
      return;
    case ScanOutcome::Kind::kLocalized:
      break;
  }
  report_(outcome.header, toStatus(outcome.update), outcome.update);
  if (outcome.update.wants_global) runGlobal(outcome.scan, outcome.header);
}

void BagLocalizer::runGlobal(const LocalizerScan& scan, const std_msgs::Header& header) {
  ++globals_;
  Localizer& localizer = localizer_.localizer();
  GlobalJob job = localizer.beginGlobal(scan, localizer_.gravity().down(header.frame_id, header.stamp));
  job.run();
  localizer.applyGlobal(job);
}

void BagLocalizer::reject(const std_msgs::Header& header, std::uint8_t reason, const std::string& message) {
  LocalizationUpdate update;
  update.stamp = header.stamp.toSec();
  update.state = localizer_.localizer().state();
  Status status = toStatus(update);
  status.reason = reason;
  status.message = message;
  report_(header, status, update);
}

void BagLocalizer::timeJumpedBack() {
  processRemaining();
  localizer_.timeJumpedBack();
}

}  // namespace ttsdf
