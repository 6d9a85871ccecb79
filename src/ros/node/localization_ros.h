#pragma once
// The localizer as a ROS node: topics, services, timers and parameters around a LocalizationPipeline. A
// nodelet and a node wrap it.
//
// Threads: one for clouds and poses, one for transforms in and out, one for the watch, four for services, one
// for registration (the pipeline's), one for loading maps, one for the saved pose, and one for a global
// localization while it runs. Every callback catches: this class shares its process with others.

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/Imu.h>
#include <std_srvs/Empty.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "ros/maps/atlas_source.h"
#include "ros/maps/map_source.h"
#include "ros/node/live_parameters.h"
#include "ros/node/localization_diagnostics.h"
#include "ros/node/localization_pipeline.h"
#include "ros/node/queue_threads.h"
#include "ros/node/scan_input.h"
#include "ros/poses/pose_saver.h"
#include "ros/scans/clock_watch.h"
#include "ros/scans/transform_input.h"
#include "ttsdf_localization/GetMap.h"
#include "ttsdf_localization/LoadMap.h"
#include "ttsdf_localization/SetMap.h"

namespace ttsdf {

class LocalizationRos {
 public:
  /// `node`: topics; `private_node`: parameters and services; `name` for the log and diagnostics.
  /// Throws std::invalid_argument for bad parameters; nothing has been started then.
  LocalizationRos(const ros::NodeHandle& node, const ros::NodeHandle& private_node, const std::string& name);
  ~LocalizationRos();
  LocalizationRos(const LocalizationRos&) = delete;
  LocalizationRos& operator=(const LocalizationRos&) = delete;

 private:
  using Status = ttsdf_localization::LocalizationStatus;

  // localization_ros.cpp: start, watch.
  void subscribe();
  void startTimers();
  void applyLive(const LocalizationRosOptions& options);
  std::optional<PoseRequest> poseAtStart();
  void onInitialPose(const geometry_msgs::PoseWithCovarianceStampedConstPtr& message);
  void checkClock();
  void adjustTfTimer();
  void watch();
  /// Why scans do not get on; warns when it is time.
  std::string warnWhenQuiet(const ScanCounts& scans);

  // localization_ros_services.cpp
  void advertise();
  bool getMap(ttsdf_localization::GetMap::Request& request, ttsdf_localization::GetMap::Response& response);
  bool loadMap(ttsdf_localization::LoadMap::Request& request,
               ttsdf_localization::LoadMap::Response& response);
  bool setMap(ttsdf_localization::SetMap::Request& request, ttsdf_localization::SetMap::Response& response);
  bool relocalize(ttsdf_localization::Relocalize::Request& request,
                  ttsdf_localization::Relocalize::Response& response);
  bool globalLocalization(ttsdf_localization::GlobalLocalization::Request& request,
                          ttsdf_localization::GlobalLocalization::Response& response);
  bool pause(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);
  bool reset(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  bool requestUpdate(std_srvs::Empty::Request& request, std_srvs::Empty::Response& response);

  const std::string name_;
  ros::CallbackQueue scan_queue_, transform_queue_, watch_queue_, service_queue_;
  ros::NodeHandle scan_node_, transform_node_, watch_node_, service_node_;
  const LocalizationRosOptions
      options_;  ///< as at the start; what is live is used from the parts that got it

  LocalizationPipeline pipeline_;
  LocalizationDiagnostics diagnostics_;
  PoseSaver pose_saver_;
  std::mutex clock_mutex_;
  ClockWatch clock_;
  std::atomic<bool> paused_{false};
  std::atomic<double> quiet_limit_;  ///< [s]
  std::atomic<double> tf_rate_;      ///< [Hz]
  std::mutex load_mutex_;            ///< one map after the other, in the order of the requests
  ros::WallTime started_, last_quiet_warning_, last_pose_saved_, last_diagnostics_, last_look_;
  ros::Time last_clock_;            ///< simulated time at the last look
  double tf_period_ = 0.005;        ///< [s] of wall time
  double diagnostic_period_ = 1.0;  ///< [s]
  std::string diagnosed_;           ///< state and TF when diagnostics went out last

  std::unique_ptr<MapSource> map_source_;
  std::unique_ptr<AtlasSource> atlas_source_;  ///< with map_source atlas
  std::unique_ptr<ScanInput> scans_;
  std::unique_ptr<TransformInput> transforms_;
  ros::Subscriber initial_pose_subscriber_, imu_subscriber_;
  std::vector<ros::ServiceServer> services_;
  std::unique_ptr<LiveParameters> live_parameters_;
  ros::WallTimer tf_timer_, watch_timer_;
  std::vector<std::unique_ptr<QueueThreads>> threads_;
};

/// For a node that refuses to start: a latched status that says why, so that the reason is not only in the
/// log.
ros::Publisher publishStartError(ros::NodeHandle node, const std::string& message);

}  // namespace ttsdf
