#pragma once
// The demo's director: lets the simulated camera drive with its true pose while the map builder fuses, has
// the map built, saved and loaded by the localizer, all through their services, takes the truth away, and
// watches the localizer follow the camera from drifting odometry.

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/ros.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <mutex>
#include <string>

#include "ros/demo/demo_report.h"
#include "ttsdf_localization/BuildProgress.h"
#include "ttsdf_localization/LocalizationStatus.h"
#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

struct DemoOptions {
  std::string map_file;           ///< where the map is saved; empty: a temporary file, removed at the end
  std::string summary_file;       ///< the summary is written there too; empty: only printed
  double mapping_seconds = 80.0;  ///< of driving with the true pose [s]
  double localization_seconds = 60.0;  ///< of driving without it [s]
  std::string max_rank = "60";         ///< of the map, as in ~build_map
  double start_offset = 0.2;           ///< the start pose that is given is off by this far [m] ...
  double start_turn = 0.1;             ///< ... and turned by this much [rad]
  std::string odom_frame_id = "odom";
  std::string base_frame_id = "base_link";
  double timeout = 120.0;  ///< without a sign of life of the nodes [s]
};
const OptionTable<DemoOptions>& demoOptionTable();

class DemoRos {
 public:
  /// Relative names: services camera/truth_tf, camera/stand_still, map_builder/build_map,
  /// map_builder/save_map, localization/load_map, manager/unload_nodelet; topics ground_truth, pose, status,
  /// map_builder/progress, initialpose. Throws std::invalid_argument for bad parameters.
  DemoRos(ros::NodeHandle nh, ros::NodeHandle private_nh);

  /// The whole story; blocks while other threads handle the callbacks. Throws std::runtime_error if a step
  /// fails.
  DemoReport run();
  const DemoOptions& options() const { return options_; }

 private:
  void driveAndMap();
  void buildAndSave();
  void loadAndStart();
  void driveAndLocalize();
  void standStill(bool still);

  struct TruthAndOdometry {
    Eigen::Isometry3d T_map_base, T_odom_base;
  };
  TruthAndOdometry truthAndOdometry();

  template <class Service>
  typename Service::Response call(const std::string& name, const typename Service::Request& request);
  template <class Condition>
  void waitFor(const std::string& what, const Condition& condition);
  void drive(double seconds, const std::string& what) const;

  void onTruth(const geometry_msgs::PoseStampedConstPtr& message);
  void onPose(const geometry_msgs::PoseWithCovarianceStampedConstPtr& message);
  void onStatus(const ttsdf_localization::LocalizationStatusConstPtr& message);
  void onProgress(const ttsdf_localization::BuildProgressConstPtr& message);

  DemoOptions options_;
  ros::NodeHandle nh_;
  tf2_ros::Buffer buffer_;
  tf2_ros::TransformListener listener_;
  ros::Publisher initial_pose_;
  std::vector<ros::Subscriber> subscribers_;
  const ros::WallTime start_ = ros::WallTime::now();

  std::mutex mutex_;  // guards what callbacks write
  DemoReport report_;
  std::uint32_t fused_ = 0;   ///< scans, by the builder's progress
  std::uint32_t images_ = 0;  ///< of the camera
  std::uint32_t signs_ = 0;   ///< of life: messages of any node
  bool recording_ = false;
  ros::Time recording_since_;
  geometry_msgs::PoseStamped newest_truth_;
  ttsdf_localization::LocalizationStatus newest_status_;
};

}  // namespace ttsdf
