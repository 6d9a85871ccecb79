// Global localization: in a thread of its own, on request or when the localizer wants it. Who waits for it
// gets the first pose published afterwards, not the place found: that has to hold on the next scans first.
// Where one scan does not decide in which of many maps it was taken, the search goes on with the scans of the
// drive: each is a job of its own, so that every one ends with an answer.

#include <chrono>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <utility>

#include "ros/messages/stamps.h"
#include "ros/node/localization_pipeline.h"
#include "ttsdf_localization/atlas/moving_search.h"

namespace ttsdf {

namespace {
constexpr double kProgressPeriod = 0.2;      // [s] between two statuses of a global localization
constexpr double kScanPatience = 3.0;        // [s] without a scan after which nobody waits for the next one
constexpr double kConfirmationLimit = 20.0;  // [s] for the confirmation of a place found
constexpr std::chrono::milliseconds kWaitLook{100};  // between two looks at the clock
}  // namespace

void LocalizationPipeline::startGlobal(const SeenScan& seen, bool goes_on) {
  if (stopping_ || global_worker_->running()) return;
  tf_output_.stop();
  const auto down = gravity().down(seen.header.frame_id, seen.header.stamp);
  search_goes_on_ = goes_on && T_odom_undecided_;
  pose_since_global_.reset();
  if (!search_goes_on_) {  // otherwise the answer of the one before stays for who still waits for it
    forgetUndecided();
    global_outcome_.reset();
    ++orders_;
  }
  GlobalJob job = localizer_.localizer().beginGlobal(seen.scan, down);
  search_runs_ = global_worker_->start(job);
  if (!search_runs_) {
    global_outcome_ = localizer_.localizer().applyGlobal(job);
    return;
  }
  Status status = currentStatus();
  status.message = std::string("global localization ") + (down ? "with" : "without") + " gravity" +
                   (search_goes_on_ ? ", with the scans before" : "");
  publishStatus(std::move(status), ros::Time::now(), false);
}

bool LocalizationPipeline::hasDrivenOn(const LocalizationUpdate& update, const LocalizerScan& scan) const {
  const MovingSearchOptions moving;
  // Not while the localizer tries or confirms a place that it found near the last pose.
  if (update.state != LocalizerState::kLost && update.state != LocalizerState::kWaitingForPose) return false;
  if (!T_odom_undecided_ || !scan.T_odom_base || global_worker_->running()) return false;
  if (scan.points.cols() < localizer_.localizer().options().registration.min_points) return false;
  const PoseError way = poseError(*T_odom_undecided_, *scan.T_odom_base);
  return way.translation >= moving.step || way.rotation >= moving.turn;
}

void LocalizationPipeline::noteUndecided(const GlobalJob& job) {
  if (!wider_search_.find) return;
  // One that is cancelled too late to notice does not go on either.
  if (global_worker_->cancelled() || global_outcome_->reason == RejectionReason::kCancelled ||
      !wider_search_.may_go_on()) {
    T_odom_undecided_.reset();
    wider_search_.forget();
    return;
  }
  T_odom_undecided_ = job.scan().T_odom_base;
  global_outcome_->message += "; the search goes on when the robot drives";
}

void LocalizationPipeline::forgetUndecided() {
  if (!T_odom_undecided_) return;
  T_odom_undecided_.reset();
  if (!search_runs_) wider_search_.forget();  // otherwise when that one ends, which is cancelled
}

void LocalizationPipeline::runGlobal(GlobalJob& job, const ProgressCallback& progress) {
  WiderSearch search;
  bool goes_on = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    search = wider_search_;
    goes_on = search_goes_on_;
  }
  if (!search.find) {
    job.run(progress);
    return;
  }
  job.runWith([&](const ScanPoints& /*of the scan*/, const std::optional<Eigen::Vector3d>& gravity,
                  const ProgressCallback& go_on) { return search.find(job.scan(), gravity, goes_on, go_on); },
              progress);
  if (!job.result().success) return;
  const Eigen::Vector3d found = job.T_map_base().translation();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    place_ = found;
  }
  search.loadAround(found, progress);  // the scans that confirm the place come at once
}

void LocalizationPipeline::onGlobalProgress(double share) {
  const ros::WallTime now = ros::WallTime::now();
  const std::lock_guard<std::mutex> lock(mutex_);
  if ((now - last_progress_).toSec() < kProgressPeriod || !localizer_.localizer().globalRunning()) return;
  last_progress_ = now;
  Status status = currentStatus();
  status.message = "global localization: " + std::to_string(static_cast<int>(100.0 * share)) + " %";
  publishStatus(std::move(status), ros::Time::now(), false);
}

void LocalizationPipeline::onGlobalDone(const GlobalJob& job) {
  const std::lock_guard<std::mutex> lock(mutex_);
  global_outcome_ = localizer_.localizer().applyGlobal(job);
  const std::string remark = wider_search_.remark ? wider_search_.remark() : std::string();
  if (!remark.empty()) global_outcome_->message += "; " + remark;
  search_runs_ = false;
  noteUndecided(job);
  publishStatus(toStatus(*global_outcome_), toTime(job.scan().stamp), false);
}

void LocalizationPipeline::globalLocalization(const ttsdf_localization::GlobalLocalization::Request& request,
                                              ttsdf_localization::GlobalLocalization::Response& response) {
  if (request.cancel) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      response.success = T_odom_undecided_.has_value();
      if (global_worker_->cancel()) response.success = true;
      forgetUndecided();
    }
    global_worker_->wait();  // "cancelled" means that the next one can start
    response.message = response.success ? "cancelled" : "no global localization is running";
    return;
  }
  const std::uint64_t order = orderGlobal(request.wait);
  response.message = "started";
  if (request.wait) awaitPose(order, response);
  response.success = true;
}

std::uint64_t LocalizationPipeline::orderGlobal(bool wait) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (paused_) throw std::runtime_error("paused");
  if (!localizer_.localizer().hasMap()) throw std::runtime_error("no map");
  if (!newest_scan_) throw std::runtime_error("no scan yet to localize with");
  if (global_worker_->running()) throw std::runtime_error("a global localization is running already");
  const std::string stuck = whyNoScan();
  if (wait && !stuck.empty())
    throw std::runtime_error(stuck +
                             ", wanted clouds that confirm the place (wait: false starts with the last one)");
  localizer_.dropPoseRequest();
  startGlobal(*newest_scan_, false);
  return orders_;
}

void LocalizationPipeline::awaitPose(std::uint64_t order,
                                     ttsdf_localization::GlobalLocalization::Response& response) {
  global_worker_->wait();
  const ros::WallTime deadline = ros::WallTime::now() + ros::WallDuration(kConfirmationLimit);
  std::unique_lock<std::mutex> lock(mutex_);
  if (!global_outcome_) throw std::runtime_error("ended without a result");
  response.score = global_outcome_->registration.score;
  response.runner_up_score = global_outcome_->registration.runner_up_score;
  if (global_outcome_->reason != RejectionReason::kNone) throw std::runtime_error(global_outcome_->message);
  // The order first: a pose that another one gave is not this one's.
  while (order != orders_ || !pose_since_global_) {
    checkConfirming(order, deadline);
    status_changed_.wait_for(lock, kWaitLook);
  }
  response.pose = *pose_since_global_;
  response.message = "global localization found the place, and the next scans confirm it";
}

void LocalizationPipeline::checkConfirming(std::uint64_t order, const ros::WallTime& deadline) const {
  const std::string found = "global localization found a place that is not confirmed: ";
  if (stopping_) throw std::runtime_error(found + "the node stops");
  if (order != orders_)
    throw std::runtime_error(found + "overtaken by another pose, a search, a map or a reset");
  if (paused_) throw std::runtime_error(found + "paused");
  if (localizer_.localizer().state() != LocalizerState::kRelocalizing)
    throw std::runtime_error(found + status_.message);
  const std::string stuck = whyNoScan();
  if (!stuck.empty()) throw std::runtime_error(found + stuck);
  if (ros::WallTime::now() > deadline) {
    throw std::runtime_error(found + "not within " + std::to_string(static_cast<int>(kConfirmationLimit)) +
                             " s; the last scan: " + status_.message);
  }
}

std::string LocalizationPipeline::whyNoScan() const {
  const ros::WallTime now = ros::WallTime::now();
  if (newest_scan_ && (now - newest_scan_->taken).toSec() <= kScanPatience) return {};
  ros::WallTime last_arrival;
  {
    const std::lock_guard<std::mutex> lock(counts_mutex_);
    last_arrival = counts_.last_arrival;
  }
  const auto since = [&](const ros::WallTime& then) {
    char text[32];
    std::snprintf(text, sizeof(text), " since %.1f s", (now - then).toSec());
    return std::string(text);
  };
  if (last_arrival.isZero()) return "no scan yet on '" + scan_topics_ + "'";
  if ((now - last_arrival).toSec() > kScanPatience)
    return "no scan on '" + scan_topics_ + "'" + since(last_arrival);
  return (newest_scan_ ? "no scan could be used" + since(newest_scan_->taken) : "no scan could be used yet") +
         whyWaiting();
}

}  // namespace ttsdf
