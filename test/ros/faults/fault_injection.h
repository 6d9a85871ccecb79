#pragma once
// The robot of fault_run: clock, odometry and scans of the analytic room in simulated time, and the faults in
// them.

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_srvs/Trigger.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <deque>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "../../support/room.h"
#include "../synthetic_scans.h"
#include "fault_kinds.h"
#include "ros/messages/cloud_conversion.h"
#include "ros/messages/conversions.h"
#include "ttsdf_localization/LoadMap.h"

namespace ttsdf {

constexpr int kPlaces = 120;       // on the way round the room
constexpr double kPeriod = 0.1;    // [s] between scans
constexpr double kStart = 1000.0;  // [s]

/// Not thread-safe.
class FaultyRobot {
 public:
  /// `private_node` is the localizer's. `random` is the run's: the same seed gives the same faults.
  FaultyRobot(ros::NodeHandle node, const ros::NodeHandle& private_node, std::vector<std::string> maps,
              std::mt19937& random)
      : maps_(std::move(maps)), random_(random), node_(std::move(node)), private_node_(private_node) {
    clock_ = node_.advertise<rosgraph_msgs::Clock>("/clock", 10);
    tf_ = node_.advertise<tf2_msgs::TFMessage>("/tf", 100);
    static_tf_ = node_.advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
    cloud_ = node_.advertise<sensor_msgs::PointCloud2>("cloud", 10);
    start_ = node_.advertise<geometry_msgs::PoseWithCovarianceStamped>("initialpose", 2);
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

  double now() const { return now_; }
  Eigen::Isometry3d pose() const { return placeOf(place_); }

  void setClock(double now) {
    now_ = now;
    rosgraph_msgs::Clock message;
    message.clock = ros::Time(now);
    clock_.publish(message);
  }

  void givePose() {
    geometry_msgs::PoseWithCovarianceStamped message;
    message.header.frame_id = "map";
    message.pose.pose = toPoseMessage(pose());
    for (std::size_t i = 0; i < 6; ++i) message.pose.covariance[7 * i] = 0.01;
    start_.publish(message);
  }

  /// What happens once; the clock of the next step counts from here.
  void begin(Fault fault) {
    fault_ = fault;
    switch (fault) {
      case Fault::kClockBack:
        late_.clear();
        late_scans_.clear();
        now_ = kStart;
        break;
      case Fault::kClockForward:
        now_ += 30.0;
        break;
      case Fault::kMapSwap:
        std::thread([name = private_node_.resolveName("load_map"), file = maps_[++map_ % maps_.size()]] {
          ttsdf_localization::LoadMap call;
          call.request.filename = file;
          ros::service::call(name, call);
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
  void end() { fault_ = Fault::kNone; }

  void moveOn() { place_ = (place_ + 1) % kPlaces; }
  void send(int scan) {
    sendOdometry(scan);
    sendScan();
    sendLateScans();
  }

 private:
  static Eigen::Isometry3d placeOf(int n) {
    const double turn = 2.0 * 3.14159265358979 * n / kPlaces;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() << 2.6 + 0.8 * std::cos(turn), 2.6 + 0.7 * std::sin(turn), 0.0;
    T.linear() = Eigen::AngleAxisd(turn + 1.5, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    return T;
  }

  bool during(Fault fault) const { return fault_ == fault; }

  void sendOdometry(int scan) {
    const Eigen::Isometry3d T_odom_base = T_map_odom_.inverse() * pose();
    tf2_msgs::TFMessage message;
    message.transforms = {stampedTransform(T_odom_base, "odom", "base_link", ros::Time(now_))};
    if (during(Fault::kBadTransform)) {
      tf2_msgs::TFMessage bad = message;
      bad.transforms[0].transform.translation.x = std::nan("");
      bad.transforms[0].transform.rotation.w = 7.0;
      tf_.publish(bad);
    }
    if (during(Fault::kNoOdometry)) return;
    if (during(Fault::kSlowOdometry) && scan % 10 != 0) return;
    if (during(Fault::kSlowLateOdometry) && scan % 5 != 0) return;
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

  const std::vector<std::string> maps_;
  std::mt19937& random_;
  ros::NodeHandle node_, private_node_;
  ros::Publisher clock_, tf_, static_tf_, cloud_, start_;
  std::vector<sensor_msgs::PointCloud2> clouds_;
  std::optional<sensor_msgs::PointCloud2> held_;
  std::deque<std::pair<double, tf2_msgs::TFMessage>> late_;
  std::deque<std::pair<double, sensor_msgs::PointCloud2>> late_scans_;
  std::optional<tf2_msgs::TFMessage> last_transform_;
  Eigen::Isometry3d T_map_odom_ = Eigen::Isometry3d::Identity();
  Fault fault_ = Fault::kNone;
  double now_ = kStart;
  int place_ = 0;
  std::size_t map_ = 0;
};

}  // namespace ttsdf
