#include "ros/demo/demo_ros.h"

#include <nodelet/NodeletUnload.h>
#include <std_srvs/SetBool.h>

#include <boost/filesystem.hpp>
#include <cstdio>
#include <stdexcept>

#include "ros/messages/conversions.h"
#include "ros/parameters/parameters.h"
#include "ttsdf_localization/BuildMap.h"
#include "ttsdf_localization/LoadMap.h"
#include "ttsdf_localization/SaveMap.h"

namespace ttsdf {

namespace {

/// nodelet's services carry no message.
std::string messageOf(const nodelet::NodeletUnload::Response&) { return "failed"; }
template <class Response>
std::string messageOf(const Response& response) {
  return response.message;
}

}  // namespace

using ttsdf_localization::LocalizationStatus;

const OptionTable<DemoOptions>& demoOptionTable() {
  using O = DemoOptions;
  static const OptionTable<O> kTable =
      OptionTable<O>()
          .add("map_file", &O::map_file, {}, "Where the map is saved; empty: a temporary file.")
          .add("summary_file", &O::summary_file, {}, "File for the summary; empty: only printed.")
          .add("mapping_seconds", &O::mapping_seconds, 1.0, 36000.0, "s", "Driving with the true pose.")
          .add("localization_seconds", &O::localization_seconds, 1.0, 36000.0, "s", "Driving without it.")
          .add("max_rank", &O::max_rank, {}, "Cap on the map's TT-ranks.")
          .add("start_offset", &O::start_offset, 0.0, 5.0, "m", "Error of the start pose that is given.")
          .add("start_turn", &O::start_turn, 0.0, 3.0, "rad", "Error of its heading.")
          .add("odom_frame_id", &O::odom_frame_id, {}, "Frame that odometry drifts in.")
          .add("base_frame_id", &O::base_frame_id, {}, "Frame of the body that moves.")
          .add("timeout", &O::timeout, 1.0, 3600.0, "s", "Without a sign of life of the nodes.");
  return kTable;
}

DemoRos::DemoRos(ros::NodeHandle nh, ros::NodeHandle private_nh) : nh_(nh), listener_(buffer_) {
  ParameterSet parameters;
  parameters.add("", options_, demoOptionTable());
  parameters.load(private_nh);
  initial_pose_ = nh_.advertise<geometry_msgs::PoseWithCovarianceStamped>("initialpose", 1);
  subscribers_ = {nh_.subscribe("ground_truth", 1000, &DemoRos::onTruth, this),
                  nh_.subscribe("pose", 1000, &DemoRos::onPose, this),
                  nh_.subscribe("status", 1000, &DemoRos::onStatus, this),
                  nh_.subscribe("map_builder/progress", 100, &DemoRos::onProgress, this)};
}

DemoReport DemoRos::run() {
  const bool temporary = options_.map_file.empty();
  if (temporary) {
    const auto name = boost::filesystem::unique_path("ttsdf_demo_%%%%%%%%.ttsdf");
    options_.map_file = (boost::filesystem::temp_directory_path() / name).string();
  }
  driveAndMap();
  buildAndSave();
  loadAndStart();
  driveAndLocalize();
  if (temporary) boost::filesystem::remove(options_.map_file);
  const std::lock_guard<std::mutex> lock(mutex_);
  report_.total_seconds = (ros::WallTime::now() - start_).toSec();
  return report_;
}

void DemoRos::driveAndMap() {
  std_srvs::SetBool::Request truth;
  truth.data = 1;
  call<std_srvs::SetBool>("camera/truth_tf", truth);
  waitFor("the first fused scan", [this] { return fused_ > 0; });
  ROS_INFO("Demo: the camera drives with its true pose and the map builder fuses, %.0f s",
           options_.mapping_seconds);
  drive(options_.mapping_seconds, "mapping");
  report_.mapping_seconds = options_.mapping_seconds;
}

void DemoRos::buildAndSave() {
  ROS_INFO("Demo: the camera stands still; map_builder/build_map");
  standStill(true);
  const ros::WallTime begin = ros::WallTime::now();
  ttsdf_localization::BuildMap::Request build;
  build.max_rank = options_.max_rank;
  const auto built = call<ttsdf_localization::BuildMap>("map_builder/build_map", build);
  ROS_INFO("Demo: %s", built.message.c_str());
  ttsdf_localization::SaveMap::Request save;
  save.filename = options_.map_file;
  call<ttsdf_localization::SaveMap>("map_builder/save_map", save);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    report_.build_seconds = (ros::WallTime::now() - begin).toSec();
    report_.scans_fused = built.report.scans;
    report_.dims.assign(built.report.dims.begin(), built.report.dims.end());
    report_.ranks.assign(built.report.ranks.begin(), built.report.ranks.end());
    report_.encoding = built.report.encoding;
    report_.dense_bytes = built.report.dense_bytes;
    report_.surface_rms = built.report.surface_rms;
    report_.map_bytes = boost::filesystem::file_size(options_.map_file);
  }
  // The robot needs no builder any more: its cores are for localization.
  nodelet::NodeletUnload::Request unload;
  unload.name = nh_.resolveName("map_builder");
  call<nodelet::NodeletUnload>("manager/unload_nodelet", unload);
}

void DemoRos::loadAndStart() {
  ROS_INFO("Demo: localization/load_map, then no more truth");
  ttsdf_localization::LoadMap::Request load;
  load.filename = options_.map_file;
  call<ttsdf_localization::LoadMap>("localization/load_map", load);
  std_srvs::SetBool::Request truth;
  truth.data = 0;
  call<std_srvs::SetBool>("camera/truth_tf", truth);

  geometry_msgs::PoseWithCovarianceStamped start;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    start.header = newest_truth_.header;
    Eigen::Isometry3d T = fromMessage(newest_truth_.pose);
    T.translate(Eigen::Vector3d(0.6, 0.8, 0.0) * options_.start_offset);
    T.rotate(Eigen::AngleAxisd(options_.start_turn, Eigen::Vector3d::UnitZ()));
    start.pose.pose = toPoseMessage(T);
  }
  Matrix6d covariance = Matrix6d::Zero();  // [rotation; translation]
  covariance.diagonal() << 0.01, 0.01, 0.03, 0.1, 0.1, 0.1;
  start.pose.covariance = toCovarianceMessage(covariance);
  initial_pose_.publish(start);
  waitFor("the localizer to track", [this] { return newest_status_.state == LocalizationStatus::TRACKING; });
  standStill(false);
}

void DemoRos::standStill(bool still) {
  std_srvs::SetBool::Request request;
  request.data = static_cast<std::uint8_t>(still);
  call<std_srvs::SetBool>("camera/stand_still", request);
}

void DemoRos::driveAndLocalize() {
  ROS_INFO("Demo: the camera drives on with drifting odometry and the localizer follows, %.0f s",
           options_.localization_seconds);
  const TruthAndOdometry begin = truthAndOdometry();
  LocalizationStatus first;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    first = newest_status_;
    recording_since_ = first.header.stamp;
    recording_ = true;
  }
  drive(options_.localization_seconds, "localizing");
  const TruthAndOdometry end = truthAndOdometry();
  const Eigen::Isometry3d T_map_odom = begin.T_map_base * begin.T_odom_base.inverse();
  const std::lock_guard<std::mutex> lock(mutex_);
  recording_ = false;
  report_.localization_seconds = options_.localization_seconds;
  report_.scans = newest_status_.scans - first.scans;
  report_.dropped = newest_status_.dropped - first.dropped;
  report_.odometry_error = poseError(end.T_map_base, T_map_odom * end.T_odom_base).translation;
}

DemoRos::TruthAndOdometry DemoRos::truthAndOdometry() {
  geometry_msgs::PoseStamped truth;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    truth = newest_truth_;
  }
  const auto odometry = buffer_.lookupTransform(options_.odom_frame_id, options_.base_frame_id,
                                                truth.header.stamp, ros::Duration(options_.timeout));
  return {fromMessage(truth.pose), fromMessage(odometry.transform)};
}

void DemoRos::drive(double seconds, const std::string& what) const {
  constexpr double kReportEvery = 20.0;  // [s]
  const ros::WallTime begin = ros::WallTime::now();
  double reported = 0.0;
  for (double passed = 0.0; passed < seconds; passed = (ros::WallTime::now() - begin).toSec()) {
    if (!ros::ok()) throw std::runtime_error("the demo was interrupted while " + what);
    if (passed >= reported + kReportEvery) {
      reported += kReportEvery;
      ROS_INFO("Demo: %s, %.0f of %.0f s", what.c_str(), reported, seconds);
    }
    ros::WallDuration(0.1).sleep();
  }
}

// Patience is counted in camera images, not in seconds: a slow machine has more of it. Only silence has a
// clock.
template <class Condition>
void DemoRos::waitFor(const std::string& what, const Condition& condition) {
  constexpr std::uint32_t kPatience = 900;  // images: a minute on a machine that keeps up
  std::uint32_t first = 0, signs = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    first = images_;
  }
  ros::WallTime heard = ros::WallTime::now();
  while (ros::ok()) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (condition()) return;
      if (images_ - first > kPatience) {
        throw std::runtime_error("waited " + std::to_string(kPatience) + " camera images for " + what);
      }
      if (signs_ != signs) heard = ros::WallTime::now();
      signs = signs_;
    }
    if ((ros::WallTime::now() - heard).toSec() > options_.timeout) {
      throw std::runtime_error("no node gave a sign of life for " +
                               std::to_string(static_cast<int>(options_.timeout)) + " s while waiting for " +
                               what);
    }
    ros::WallDuration(0.02).sleep();
  }
  throw std::runtime_error("the demo was interrupted while waiting for " + what);
}

template <class Service>
typename Service::Response DemoRos::call(const std::string& name, const typename Service::Request& request) {
  const std::string resolved = nh_.resolveName(name);
  if (!ros::service::waitForService(resolved, ros::Duration(options_.timeout))) {
    throw std::runtime_error("service " + resolved + " is not there");
  }
  Service service;
  service.request = request;
  if (!ros::service::call(resolved, service))
    throw std::runtime_error("service " + resolved + " gave no answer");
  if (!service.response.success) throw std::runtime_error(resolved + ": " + messageOf(service.response));
  return service.response;
}

void DemoRos::onTruth(const geometry_msgs::PoseStampedConstPtr& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  newest_truth_ = *message;
  ++images_;
  ++signs_;
  if (recording_) report_.truth.push_back({message->header.stamp.toSec(), fromMessage(message->pose)});
}

void DemoRos::onPose(const geometry_msgs::PoseWithCovarianceStampedConstPtr& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!recording_ || message->header.stamp <= recording_since_) return;
  report_.estimate.push_back({message->header.stamp.toSec(), fromMessage(message->pose.pose)});
}

void DemoRos::onStatus(const ttsdf_localization::LocalizationStatusConstPtr& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++signs_;
  if (recording_) {
    const bool newly_lost =
        message->state == LocalizationStatus::LOST && newest_status_.state != LocalizationStatus::LOST;
    report_.times_lost += newly_lost;
    if (message->pose_valid) {
      ++report_.localised;
      report_.registration_ms.push_back(message->milliseconds);
      report_.latency_ms.push_back(1e3 * message->latency);
    }
  }
  newest_status_ = *message;
}

void DemoRos::onProgress(const ttsdf_localization::BuildProgressConstPtr& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++signs_;
  fused_ = message->fused;
  if (message->step != "fusing") {
    ROS_INFO_THROTTLE(10.0, "Demo: the map is built: %s, %.0f %%", message->step.c_str(),
                      100.0 * message->share);
  }
}

}  // namespace ttsdf
