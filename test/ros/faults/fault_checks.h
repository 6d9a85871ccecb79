#pragma once
// What the localizer says during a fault_run: poses against the truth, states, transforms and diagnostics
// against each other, and the table of the whole run.

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/ros.h>
#include <tf2_msgs/TFMessage.h>
#include <unistd.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "fault_kinds.h"
#include "ros/messages/conversions.h"
#include "ttsdf_localization/LocalizationStatus.h"

namespace ttsdf {

/// Thread-safe.
class FaultChecks {
 public:
  explicit FaultChecks(ros::NodeHandle node)
      : subscribers_{node.subscribe("pose", 100, &FaultChecks::onPose, this),
                     node.subscribe("status", 1000, &FaultChecks::onStatus, this),
                     node.subscribe("/diagnostics", 100, &FaultChecks::onDiagnostics, this),
                     node.subscribe("/tf", 1000, &FaultChecks::onTf, this)} {}

  bool hasMap() const {
    return locked([this] { return !map_id_.empty(); });
  }
  bool isTracking() const {
    return locked([this] { return tracking_; });
  }

  /// `calm`: without a fault for some time, so that the localizer has to track.
  void noteScan(int scan, const ros::Time& stamp, const Eigen::Isometry3d& T_map_base, bool calm) {
    const Lock lock(mutex_);
    scan_ = scan;
    calm_ = calm;
    truth_[stamp.toNSec()] = T_map_base.translation();
    if (truth_.size() > 3000) truth_.erase(truth_.begin());
  }

  void begin(Fault fault) {
    const Lock lock(mutex_);
    calm_ = said_ = was_lost_ = false;
    fault_ = fault;
    fault_begin_ = Wall::now();
    ++rows_[fault].injected;
    if (fault == Fault::kClockBack) truth_.clear();
  }

  void end() {
    const auto saidAll = [this] { return said_ || !mustBeSaid(fault_); };
    // What it has to say may take a second longer than the fault lasts.
    for (int n = 0; n < 20 && !locked(saidAll); ++n)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    const Lock lock(mutex_);
    if (fault_ == Fault::kNone) return;
    Row& row = rows_[fault_];
    row.said += said_;
    row.lost += was_lost_;
    if (said_) row.slowest = std::max(row.slowest, said_after_);
    if (!saidAll()) {
      ++unsaid_;
      std::printf("not said: %s, scan %d\n", nameOf(fault_), scan_);
    }
    fault_ = Fault::kNone;
  }

  /// Of this process, as it is now.
  void noteMemory() {
    long size = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> size >> resident;
    const Lock lock(mutex_);
    memory_.push_back(static_cast<double>(resident * sysconf(_SC_PAGESIZE)) / 1e6);
  }

  /// Prints the table; true: nothing went wrong.
  bool report(int scans, int scans_per_memory) {
    const Lock lock(mutex_);
    std::printf(
        "| fault | injected | to be said | said | slowest [s] | scans until tracked: lost again "
        "|\n|---|---|---|---|---|---|\n");
    for (int n = 1; n < static_cast<int>(Fault::kCount); ++n) {
      const auto fault = static_cast<Fault>(n);
      const Row& row = rows_[fault];
      std::printf("| %s | %d | %s | %d | %.2f | %d |\n", nameOf(fault), row.injected,
                  mustBeSaid(fault) ? "yes" : "no", row.said, row.slowest, row.lost);
    }
    std::printf(
        "scans %d, poses %d, poses off by more than %.2f m: %d (worst %.3f m), of them beyond 3 sigma of "
        "their covariance: %d, transforms sent in a state "
        "without: %d, "
        "faults said too late or not: %d, states other than tracking without a fault: %d\n",
        scans, poses_, kGoodPose, far_poses_, worst_, bad_poses_, bad_transforms_, unsaid_, false_alarms_);
    std::printf("memory [MB] after each %d scans:", scans_per_memory);
    for (const double megabytes : memory_) std::printf(" %.1f", megabytes);
    std::printf("\n");
    return bad_poses_ + bad_transforms_ + unsaid_ + false_alarms_ == 0;
  }

 private:
  using Status = ttsdf_localization::LocalizationStatus;
  using Wall = std::chrono::steady_clock;
  using Lock = std::lock_guard<std::mutex>;

  static constexpr double kGoodPose = 0.10;  // [m]
  static constexpr double kSigmas = 3.0;     // a pose further off that says so by its covariance is not good
  static constexpr std::chrono::milliseconds kOnItsWay{300};

  struct Row {
    int injected = 0, said = 0, lost = 0;
    double slowest = 0.0;  ///< [s] until it was said, wall time
  };

  template <class Condition>
  bool locked(const Condition& condition) const {
    const Lock lock(mutex_);
    return condition();
  }

  void noteSaid(const std::string& message) {
    if (said_ || fault_ == Fault::kNone) return;
    if (message.find("; odometry is missing") != std::string::npos && fault_ != Fault::kNoOdometry) return;
    said_ = true;
    said_after_ = std::chrono::duration<double>(Wall::now() - fault_begin_).count();
  }

  void onPose(const geometry_msgs::PoseWithCovarianceStampedConstPtr& pose) {
    const Lock lock(mutex_);
    const auto truth = truth_.find(pose->header.stamp.toNSec());
    if (truth == truth_.end()) return;
    ++poses_;
    const double error = (fromMessage(pose->pose.pose).translation() - truth->second).norm();
    worst_ = std::max(worst_, error);
    if (error <= kGoodPose) return;
    ++far_poses_;
    const Eigen::Vector3d sigma = Eigen::Map<const Eigen::Matrix<double, 6, 6>>(pose->pose.covariance.data())
                                      .topLeftCorner<3, 3>()
                                      .selfadjointView<Eigen::Lower>()
                                      .eigenvalues()
                                      .cwiseSqrt();
    std::printf("pose off by %.3f m, sigma %.3f m, at scan %d during: %s\n", error, sigma.maxCoeff(), scan_,
                nameOf(fault_));
    if (error > kSigmas * sigma.maxCoeff()) ++bad_poses_;
  }

  void onStatus(const ttsdf_localization::LocalizationStatusConstPtr& status) {
    const Lock lock(mutex_);
    if (!status->map_id.empty()) map_id_ = status->map_id;
    if (calm_ && tracking_ && status->state != Status::TRACKING) {
      ++false_alarms_;
      std::printf("%s without a fault, scan %d: %s\n", status->state_name.c_str(), scan_,
                  status->message.c_str());
    }
    tracking_ = status->state == Status::TRACKING;
    const bool sends = tracking_ || status->state == Status::DEGRADED || status->state == Status::PAUSED;
    if (!sends && sends_) silent_since_ = Wall::now();
    sends_ = sends;
    checkEarlyTransform();
    was_lost_ = was_lost_ || status->state == Status::LOST;
    const bool good = tracking_ && status->reason == Status::REASON_NONE && status->pose_valid;
    if (!good || status->message.find("odometry is missing") != std::string::npos) noteSaid(status->message);
  }

  void onDiagnostics(const diagnostic_msgs::DiagnosticArrayConstPtr& message) {
    const Lock lock(mutex_);
    for (const auto& status : message->status) {
      if (status.level != diagnostic_msgs::DiagnosticStatus::OK) noteSaid(status.message);
    }
  }

  void onTf(const tf2_msgs::TFMessageConstPtr& message) {
    for (const auto& transform : message->transforms) {
      if (transform.header.frame_id != "map") continue;
      const Lock lock(mutex_);
      // What was on its way when the state changed does not count.
      if (!early_transform_ && !sends_ && Wall::now() - silent_since_ > kOnItsWay)
        early_transform_ = Wall::now();
      checkEarlyTransform();
    }
  }

  /// Transforms and statuses are two topics: the first transform may be here before the status that allows
  /// it.
  void checkEarlyTransform() {
    if (!early_transform_) return;
    const bool late = Wall::now() - *early_transform_ > kOnItsWay;
    if (late) {
      ++bad_transforms_;
      std::printf("a transform in a state without, scan %d during: %s\n", scan_, nameOf(fault_));
    }
    if (late || sends_) early_transform_.reset();
  }

  mutable std::mutex mutex_;
  Fault fault_ = Fault::kNone;
  int scan_ = 0;
  Wall::time_point fault_begin_, silent_since_ = Wall::now();
  std::optional<Wall::time_point> early_transform_;
  bool said_ = false, was_lost_ = false, sends_ = false, tracking_ = false, calm_ = false;
  double said_after_ = 0.0;
  std::map<std::uint64_t, Eigen::Vector3d> truth_;  ///< by stamp [ns]
  std::string map_id_;
  std::vector<double> memory_;  ///< [MB]
  std::map<Fault, Row> rows_;
  int poses_ = 0, far_poses_ = 0, bad_poses_ = 0, unsaid_ = 0, false_alarms_ = 0, bad_transforms_ = 0;
  double worst_ = 0.0;  ///< [m]

  std::vector<ros::Subscriber> subscribers_;  ///< last: their callbacks use what is above
};

}  // namespace ttsdf
