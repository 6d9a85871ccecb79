// The localizer under faults for as long as one likes: scans of the analytic room in simulated time, a random
// fault in one of 300 scans, and what state, transforms, diagnostics and poses said about it. Prints a table,
// one line per kind of fault.
//
// usage: fault_run --map FILE --other-map FILE [--scans N] [--speed X] [--one-in N] [--seed N] [--only REGEX]
// (with a ROS master; --only: the faults whose names match)

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>
#include <std_srvs/Trigger.h>
#include <tf2_msgs/TFMessage.h>
#include <unistd.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <deque>
#include <fstream>
#include <map>
#include <random>
#include <regex>
#include <thread>

#include "../support/room.h"
#include "fault_kinds.h"
#include "ros/messages/cloud_conversion.h"
#include "ros/messages/conversions.h"
#include "ros/node/localization_ros.h"
#include "synthetic_scans.h"

namespace ttsdf {
namespace {

using Status = ttsdf_localization::LocalizationStatus;
using Wall = std::chrono::steady_clock;

constexpr int kPlaces = 120;        // on the way round the room
constexpr double kPeriod = 0.1;     // [s] between scans
constexpr double kStart = 1000.0;   // [s]
constexpr double kGoodPose = 0.10;  // [m]
constexpr int kMemoryLooks = 10;    // in the whole run
constexpr double kSigmas = 3.0;     // a pose further off that says so by its covariance is not called good

struct Row {
  int injected = 0, said = 0, lost = 0;
  double slowest = 0.0;  ///< [s] until it was said, wall time
};

Eigen::Isometry3d placeOf(int n) {
  const double turn = 2.0 * 3.14159265358979 * n / kPlaces;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << 2.6 + 0.8 * std::cos(turn), 2.6 + 0.7 * std::sin(turn), 0.0;
  T.linear() = Eigen::AngleAxisd(turn + 1.5, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return T;
}

class Run {
 public:
  Run(const std::string& map, const std::string& other, int scans, double speed, unsigned one_in,
      unsigned seed, const std::string& only)
      : maps_{map, other},
        scans_(scans),
        speed_(speed),
        one_in_(one_in),
        only_(only),
        random_(seed),
        private_node_("~") {
    private_node_.setParam("map_file", map);
    private_node_.setParam("recovery/allow_global", false);
    clock_ = node_.advertise<rosgraph_msgs::Clock>("/clock", 10);
    tf_ = node_.advertise<tf2_msgs::TFMessage>("/tf", 100);
    static_tf_ = node_.advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
    cloud_ = node_.advertise<sensor_msgs::PointCloud2>("cloud", 10);
    start_ = node_.advertise<geometry_msgs::PoseWithCovarianceStamped>("initialpose", 2);
    subscribers_ = {node_.subscribe("pose", 100, &Run::onPose, this),
                    node_.subscribe("status", 1000, &Run::onStatus, this),
                    node_.subscribe("/diagnostics", 100, &Run::onDiagnostics, this),
                    node_.subscribe("/tf", 1000, &Run::onTf, this)};
    const Eigen::Isometry3d T_base_camera = test::cameraPose({0.15, 0.0, 1.2}, 0.0, 0.1);
    std_msgs::Header header;
    header.frame_id = "camera";
    for (int n = 0; n < kPlaces; ++n) {
      clouds_.push_back(toCloudMessage(
          test::renderScan(test::Room(), placeOf(n) * T_base_camera, 64, 48, 0.005, 1U + n), header));
      clouds_.back().height = 48;
      clouds_.back().width = 64;
      clouds_.back().row_step = 64 * 12;
    }
    T_map_odom_.translation() << 0.3, -0.2, 0.0;
    tf2_msgs::TFMessage mount;
    mount.transforms = {stampedTransform(T_base_camera, "base_link", "camera", ros::Time(kStart))};
    static_tf_.publish(mount);
  }

  int run() {
    ros::AsyncSpinner spinner(2);
    spinner.start();
    setClock(kStart);
    LocalizationRos localizer(node_, private_node_, "localization");
    wait([this] { return !map_id_.empty(); });
    givePose();
    for (sent_ = 0; sent_ < scans_ && ros::ok(); ++sent_) step();
    end(Wall::now());
    std::printf(
        "| fault | injected | to be said | said | slowest [s] | scans until tracked: lost again "
        "|\n|---|---|---|---|---|---|\n");
    for (int n = 1; n < static_cast<int>(Fault::kCount); ++n) {
      const Row& row = rows_[n];
      std::printf("| %s | %d | %s | %d | %.2f | %d |\n", kNames[n], row.injected,
                  mustBeSaid(static_cast<Fault>(n)) ? "yes" : "no", row.said, row.slowest, row.lost);
    }
    std::printf(
        "scans %d, poses %d, poses off by more than %.2f m: %d (worst %.3f m), of them beyond 3 sigma of "
        "their covariance: %d, transforms sent in a state "
        "without: %d, "
        "faults said too late or not: %d, states other than tracking without a fault: %d\n",
        sent_.load(), poses_, kGoodPose, far_poses_, worst_, bad_poses_, bad_transforms_.load(), unsaid_,
        false_alarms_);
    std::printf("memory [MB] after each %d scans:", std::max(1, scans_ / kMemoryLooks));
    for (const double megabytes : memory_) std::printf(" %.1f", megabytes);
    std::printf("\n");
    return bad_poses_ + bad_transforms_.load() + unsaid_ + false_alarms_ == 0 ? 0 : 1;
  }

 private:
  template <class Condition>
  void wait(const Condition& condition) {
    for (int n = 0; n < 600 && ros::ok(); ++n) {
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (condition()) return;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }

  /// Of this process, as it is now [MB].
  static double memory() {
    long size = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> size >> resident;
    return static_cast<double>(resident * sysconf(_SC_PAGESIZE)) / 1e6;
  }

  void noteMemory() {
    if ((sent_ + 1) % std::max(1, scans_ / kMemoryLooks) == 0) memory_.push_back(memory());
  }

  void setClock(double now) {
    now_ = now;
    rosgraph_msgs::Clock message;
    message.clock = ros::Time(now);
    clock_.publish(message);
  }

  void givePose() {
    geometry_msgs::PoseWithCovarianceStamped message;
    message.header.frame_id = "map";
    message.pose.pose = toPoseMessage(placeOf(place_));
    for (std::size_t i = 0; i < 6; ++i) message.pose.covariance[7 * i] = 0.01;
    start_.publish(message);
  }

  bool during(Fault fault) const { return fault_ == fault; }

  void step() {
    setClock(now_ + kPeriod);
    const Wall::time_point begin = Wall::now();
    if (fault_ != Fault::kNone && now_ > fault_end_) end(begin);
    if (fault_ == Fault::kNone && now_ > quiet_until_ && tracking_ && random_() % one_in_ == 0) inject();
    calm_ = fault_ == Fault::kNone && now_ > quiet_until_;
    if (fault_ == Fault::kNone && now_ > quiet_until_ && !tracking_ && now_ - last_pose_given_ > 5.0) {
      last_pose_given_ = now_;
      givePose();
    }
    place_ = (place_ + 1) % kPlaces;
    sendOdometry();
    sendScan();
    sendLateScans();
    noteMemory();
    std::this_thread::sleep_until(
        begin + std::chrono::duration_cast<Wall::duration>(std::chrono::duration<double>(kPeriod / speed_)));
  }

  void inject() {
    calm_ = false;
    do {
      fault_ = static_cast<Fault>(1 + random_() % (static_cast<unsigned>(Fault::kCount) - 1));
    } while (!std::regex_search(kNames[static_cast<int>(fault_.load())], only_));
    fault_end_ = now_ + secondsOf(fault_);
    fault_begin_ = Wall::now();
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      said_ = false;
      was_lost_ = false;
    }
    ++rows_[static_cast<int>(fault_.load())].injected;
    ROS_INFO("scan %d: %s", sent_.load(), kNames[static_cast<int>(fault_.load())]);
    switch (fault_) {
      case Fault::kClockBack: {
        const std::lock_guard<std::mutex> lock(mutex_);
        truth_.clear();
        late_.clear();
        late_scans_.clear();
        now_ = kStart;
        fault_end_ = now_ + 1.0;
        break;
      }
      case Fault::kClockForward:
        now_ += 30.0;
        fault_end_ += 30.0;
        break;
      case Fault::kMapSwap:
        std::thread([this, file = maps_[++map_ % 2]] {
          ttsdf_localization::LoadMap call;
          call.request.filename = file;
          ros::service::call(private_node_.resolveName("load_map"), call);
        }).detach();
        break;
      case Fault::kReset: {
        std_srvs::Trigger call;
        ros::service::call(private_node_.resolveName("reset"), call);
        givePose();
        break;
      }
      default:
        break;
    }
  }

  void end(Wall::time_point) {
    if (fault_ == Fault::kNone) return;
    // What it has to say may take a second longer than the fault lasts.
    if (mustBeSaid(fault_)) {
      for (int n = 0; n < 20; ++n) {
        {
          const std::lock_guard<std::mutex> lock(mutex_);
          if (said_) break;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    Row& row = rows_[static_cast<int>(fault_.load())];
    row.said += said_;
    row.lost += was_lost_;
    if (said_) row.slowest = std::max(row.slowest, said_after_);
    if (mustBeSaid(fault_) && !said_) {
      ++unsaid_;
      std::printf("not said: %s, scan %d\n", kNames[static_cast<int>(fault_.load())], sent_.load());
    }
    fault_ = Fault::kNone;
    quiet_until_ = now_ + 3.0;
  }

  void sendOdometry() {
    const Eigen::Isometry3d T_odom_base = T_map_odom_.inverse() * placeOf(place_);
    tf2_msgs::TFMessage message;
    message.transforms = {stampedTransform(T_odom_base, "odom", "base_link", ros::Time(now_))};
    if (during(Fault::kBadTransform)) {
      tf2_msgs::TFMessage bad = message;
      bad.transforms[0].transform.translation.x = std::nan("");
      bad.transforms[0].transform.rotation.w = 7.0;
      tf_.publish(bad);
    }
    if (during(Fault::kNoOdometry)) return;
    if (during(Fault::kSlowOdometry) && sent_ % 10 != 0) return;
    if (during(Fault::kSlowLateOdometry) && sent_ % 5 != 0) return;
    const bool is_late = during(Fault::kLateOdometry) || during(Fault::kSlowLateOdometry);
    const double delay = is_late ? 0.1 * static_cast<double>(random_() % 10) : 0.0;
    late_.emplace_back(std::max(now_ + delay, late_.empty() ? 0.0 : late_.back().first), message);
    while (!late_.empty() && late_.front().first <= now_ + 1e-6) {
      tf_.publish(late_.front().second);
      if (during(Fault::kTransformsTwice)) {
        tf_.publish(late_.front().second);
        if (last_transform_) tf_.publish(*last_transform_);
      }
      last_transform_ = late_.front().second;
      late_.pop_front();
    }
  }

  void sendLateScans() {
    for (auto it = late_scans_.begin(); it != late_scans_.end();) {
      const bool due = it->first <= now_ + 1e-6;
      if (due) cloud_.publish(it->second);
      it = due ? late_scans_.erase(it) : std::next(it);
    }
  }

  void sendScan() {
    sensor_msgs::PointCloud2 cloud = clouds_[static_cast<std::size_t>(place_)];
    cloud.header.stamp = ros::Time(now_);
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      truth_[cloud.header.stamp.toNSec()] = place_;
      if (truth_.size() > 3000) truth_.erase(truth_.begin());
    }
    damageScan(fault_, random_, cloud);
    switch (fault_) {
      case Fault::kDropScans:
        if (random_() % 2) return;
        break;
      case Fault::kDeadCamera:
        return;
      case Fault::kDuplicates:
        cloud_.publish(cloud);
        break;
      case Fault::kReordered:
        if (!held_) {
          held_ = cloud;
          return;
        }
        cloud_.publish(cloud);
        cloud_.publish(*held_);
        held_.reset();
        return;
      case Fault::kLateScans:
        late_scans_.emplace_back(now_ + 0.1 * static_cast<double>(random_() % 10), cloud);
        return;
      default:
        break;
    }
    held_.reset();
    cloud_.publish(cloud);
  }

  // ---- what the localizer says
  // --------------------------------------------------------------------------------------

  void noteSaid(const std::string& message) {
    if (said_ || fault_ == Fault::kNone) return;
    if (message.find("; odometry is missing") != std::string::npos && fault_ != Fault::kNoOdometry) return;
    said_ = true;
    said_after_ = std::chrono::duration<double>(Wall::now() - fault_begin_).count();
  }

  void onPose(const geometry_msgs::PoseWithCovarianceStampedConstPtr& pose) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto truth = truth_.find(pose->header.stamp.toNSec());
    if (truth == truth_.end()) return;
    ++poses_;
    const double error =
        (fromMessage(pose->pose.pose).translation() - placeOf(truth->second).translation()).norm();
    worst_ = std::max(worst_, error);
    if (error <= kGoodPose) return;
    ++far_poses_;
    const Eigen::Vector3d sigma = Eigen::Map<const Eigen::Matrix<double, 6, 6>>(pose->pose.covariance.data())
                                      .topLeftCorner<3, 3>()
                                      .selfadjointView<Eigen::Lower>()
                                      .eigenvalues()
                                      .cwiseSqrt();
    std::printf("pose off by %.3f m, sigma %.3f m, at scan %d during: %s\n", error, sigma.maxCoeff(),
                sent_.load(), kNames[static_cast<int>(fault_.load())]);
    if (error > kSigmas * sigma.maxCoeff()) ++bad_poses_;
  }

  void onStatus(const ttsdf_localization::LocalizationStatusConstPtr& status) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!status->map_id.empty()) map_id_ = status->map_id;
    if (calm_ && tracking_ && status->state != Status::TRACKING) {
      ++false_alarms_;
      std::printf("%s without a fault, scan %d: %s\n", status->state_name.c_str(), sent_.load(),
                  status->message.c_str());
    }
    tracking_ = status->state == Status::TRACKING;
    const bool sends = tracking_ || status->state == Status::DEGRADED || status->state == Status::PAUSED;
    if (!sends && sends_) silent_since_ = Wall::now();
    sends_ = sends;
    judgeEarlyTransform();
    was_lost_ = was_lost_ || status->state == Status::LOST;
    if (status->state != Status::TRACKING || status->reason != Status::REASON_NONE || !status->pose_valid)
      noteSaid(status->message);
    else if (status->message.find("odometry is missing") != std::string::npos)
      noteSaid(status->message);
  }

  void onDiagnostics(const diagnostic_msgs::DiagnosticArrayConstPtr& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& status : message->status) {
      if (status.level != diagnostic_msgs::DiagnosticStatus::OK) noteSaid(status.message);
    }
  }

  void onTf(const tf2_msgs::TFMessageConstPtr& message) {
    for (const auto& transform : message->transforms) {
      if (transform.header.frame_id != "map") continue;
      const std::lock_guard<std::mutex> lock(mutex_);
      // What was on its way when the state changed does not count.
      if (!early_transform_ && !sends_ && Wall::now() - silent_since_ > kOnItsWay)
        early_transform_ = Wall::now();
      judgeEarlyTransform();
    }
  }

  /// Transforms and statuses are two topics: the first transform may be here before the status that allows
  /// it.
  void judgeEarlyTransform() {
    if (!early_transform_) return;
    const bool late = Wall::now() - *early_transform_ > kOnItsWay;
    if (late) {
      ++bad_transforms_;
      std::printf("a transform in a state without, scan %d during: %s\n", sent_.load(),
                  kNames[static_cast<int>(fault_.load())]);
    }
    if (late || sends_) early_transform_.reset();
  }

  const std::vector<std::string> maps_;
  const int scans_;
  const double speed_;
  const unsigned one_in_;
  const std::regex only_;  ///< names of the faults to inject
  std::mt19937 random_;
  ros::NodeHandle node_, private_node_;
  ros::Publisher clock_, tf_, static_tf_, cloud_, start_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<sensor_msgs::PointCloud2> clouds_;
  std::optional<sensor_msgs::PointCloud2> held_;
  std::deque<std::pair<double, tf2_msgs::TFMessage>> late_;
  std::deque<std::pair<double, sensor_msgs::PointCloud2>> late_scans_;
  std::optional<tf2_msgs::TFMessage> last_transform_;
  Eigen::Isometry3d T_map_odom_ = Eigen::Isometry3d::Identity();
  double now_ = kStart, fault_end_ = 0.0, quiet_until_ = kStart + 10.0, last_pose_given_ = kStart;
  int place_ = 0, map_ = 0;
  std::atomic<int> sent_{0};

  std::mutex mutex_;
  std::atomic<Fault> fault_{Fault::kNone};
  Wall::time_point fault_begin_, silent_since_ = Wall::now();
  std::optional<Wall::time_point> early_transform_;
  static constexpr std::chrono::milliseconds kOnItsWay{300};
  bool said_ = false, was_lost_ = false, sends_ = false;
  std::atomic<bool> tracking_{false}, calm_{false};
  int false_alarms_ = 0;
  std::vector<double> memory_;
  double said_after_ = 0.0;
  std::map<std::uint64_t, int> truth_;
  std::string map_id_;
  std::map<int, Row> rows_;
  int poses_ = 0, far_poses_ = 0, bad_poses_ = 0, unsaid_ = 0;
  std::atomic<int> bad_transforms_{0};
  double worst_ = 0.0;
};

}  // namespace
}  // namespace ttsdf

int main(int argc, char** argv) {
  ros::init(argc, argv, "localization");
  // Before the first NodeHandle: roscpp asks for it once, when that is made.
  ros::param::set("/use_sim_time", true);
  std::string map, other, only;
  int scans = 3000;
  double speed = 4.0;
  unsigned one_in = 300, seed = 1;
  for (int n = 1; n + 1 < argc; n += 2) {
    const std::string name = argv[n], value = argv[n + 1];
    if (name == "--map") map = value;
    if (name == "--other-map") other = value;
    if (name == "--scans") scans = std::stoi(value);
    if (name == "--speed") speed = std::stod(value);
    if (name == "--one-in") one_in = static_cast<unsigned>(std::stoul(value));
    if (name == "--only") only = value;
    if (name == "--seed") seed = static_cast<unsigned>(std::stoul(value));
  }
  if (map.empty() || other.empty()) {
    std::fprintf(
        stderr,
        "usage: fault_run --map FILE --other-map FILE [--scans N] [--speed X] [--one-in N] [--seed N] "
        "[--only REGEX]\n");
    return 2;
  }
  try {
    std::regex check(only);
  } catch (const std::regex_error& error) {
    std::fprintf(stderr, "--only: got '%s', wanted a regular expression (%s)\n", only.c_str(), error.what());
    return 2;
  }
  const auto matches = [&only](const char* name) { return std::regex_search(name, std::regex(only)); };
  if (std::none_of(std::begin(ttsdf::kNames) + 1, std::end(ttsdf::kNames), matches)) {
    std::fprintf(stderr, "--only: got '%s', which is the name of no fault\n", only.c_str());
    return 2;
  }
  return ttsdf::Run(map, other, scans, speed, one_in, seed, only).run();
}
