#pragma once
// The localizer as a ROS node: clouds and TF in, pose, TF, status and services out. A nodelet and a node wrap
// it.
//
// Threads: one for clouds, poses, maps and timers (nothing in it takes long), one for registration, two for
// services, one for loading maps, one for TF, and one for a global localization while it runs. Every callback
// catches: this class shares its process with others.

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "ttsdf_localization/GetMap.h"
#include "ttsdf_localization/GlobalLocalization.h"
#include "ttsdf_localization/LoadMap.h"
#include "ttsdf_localization/LocalizationStatus.h"
#include "ttsdf_localization/Relocalize.h"
#include "ttsdf_localization/SetMap.h"
#include "ttsdf_localization/localization/localizer.h"
#include "ttsdf_localization/ros/clock_watch.h"
#include "ttsdf_localization/ros/cloud_input.h"
#include "ttsdf_localization/ros/global_worker.h"
#include "ttsdf_localization/ros/gravity_hint.h"
#include "ttsdf_localization/ros/live_parameters.h"
#include "ttsdf_localization/ros/localization_diagnostics.h"
#include "ttsdf_localization/ros/localization_options.h"
#include "ttsdf_localization/ros/localization_output.h"
#include "ttsdf_localization/ros/map_source.h"
#include "ttsdf_localization/ros/newest_slot.h"
#include "ttsdf_localization/ros/pose_input.h"
#include "ttsdf_localization/ros/tf_output.h"

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

  /// A scan on its way to the registration thread. `epoch` tells scans from before a time jump or a reset.
  struct ReadyScan {
    boost::shared_ptr<const CloudScan> cloud;
    bool odometry;
    int epoch;
  };
  struct SeenScan {
    LocalizerScan scan;
    std_msgs::Header header;
    ros::WallTime taken;  ///< when it came out of the queue
  };

  // localization_ros.cpp: start, scans, results.
  void subscribe();
  void startTimers();
  void runRegistration();
  void process(const ReadyScan& ready);
  void publishUpdate(const LocalizationUpdate& update, const SeenScan& seen);
  void publishStatus(Status status, const std_msgs::Header& header);
  /// Warns, and says so in the status.
  void refuse(const std_msgs::Header& header, std::uint8_t reason, const std::string& message);
  /// In the status only.
  void announce(const std_msgs::Header& header, std::uint8_t reason, const std::string& message);
  std::string whatIsAwaited() const;
  bool onArrived(const std_msgs::Header& header);
  void onReady(const boost::shared_ptr<const CloudScan>& cloud, bool odometry);
  void putMapIntoUse(LoadedMap map);
  void applyLive(const LocalizationRosOptions& options);

  // localization_ros_watch.cpp: time jumps, timers, diagnostics, the saved pose.
  void watch();
  void timeJumpedBack(const std::string& why);
  void warnWhenQuiet();
  void updateDiagnostics();
  void saveLastPose();
  void applyStartPose();

  // localization_ros_pose.cpp: poses from outside.
  void onInitialPose(const geometry_msgs::PoseWithCovarianceStampedConstPtr& message);
  void usePose(PoseRequest request);
  void addOdometryToPose();

  // localization_ros_global.cpp: global localization, and its service.
  void startGlobal(const SeenScan& seen);
  void onGlobalProgress(double share);
  void onGlobalDone(const GlobalJob& job);
  bool globalLocalization(ttsdf_localization::GlobalLocalization::Request& request,
                          ttsdf_localization::GlobalLocalization::Response& response);
  std::uint64_t orderGlobal(bool wait);
  void awaitPose(std::uint64_t order, ttsdf_localization::GlobalLocalization::Response& response);
  void checkConfirming(std::uint64_t order, const ros::WallTime& deadline) const;
  std::string whyNoScan() const;

  // localization_ros_services.cpp
  void advertise();
  bool getMap(ttsdf_localization::GetMap::Request& request, ttsdf_localization::GetMap::Response& response);
  bool loadMap(ttsdf_localization::LoadMap::Request& request,
               ttsdf_localization::LoadMap::Response& response);
  bool setMap(ttsdf_localization::SetMap::Request& request, ttsdf_localization::SetMap::Response& response);
  bool relocalize(ttsdf_localization::Relocalize::Request& request,
                  ttsdf_localization::Relocalize::Response& response);
  bool pause(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);
  bool reset(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);

  const std::string name_;
  ros::NodeHandle node_, private_node_, service_node_;
  const LocalizationRosOptions
      options_;  ///< as at the start; what is live is used from the parts that got it
  ros::CallbackQueue input_queue_, service_queue_;

  tf2_ros::Buffer tf_buffer_;
  std::unique_ptr<tf2_ros::TransformListener> tf_listener_;
  TfOutput tf_output_;
  LocalizationOutput output_;
  GravityHint gravity_;
  LocalizationDiagnostics diagnostics_;
  ClockWatch clock_watch_;  ///< input thread only

  std::mutex mutex_;  ///< guards everything down to status_
  Localizer localizer_;
  std::optional<SeenScan> newest_scan_;
  std::optional<PoseRequest> pose_request_;  ///< not yet moved on by odometry
  int epoch_ = 0;
  std::string map_id_, map_summary_;
  std::optional<ttsdf_localization::TtSdfMap> map_message_;
  std::optional<LocalizationUpdate> global_outcome_;  ///< of the last global localization
  std::optional<geometry_msgs::PoseWithCovarianceStamped>
      pose_since_global_;     ///< newest published since it began
  std::uint64_t orders_ = 0;  ///< poses asked for so far: who waits for one notices that another is wanted
  std::condition_variable status_changed_;
  std::uint32_t refused_ = 0;
  Status status_;  ///< last one published

  std::atomic<bool> paused_{false}, stopping_{false};
  std::atomic<double> quiet_limit_;  ///< [s]
  std::atomic<std::uint32_t> dropped_{0};
  NewestSlot<ReadyScan> scans_;
  ros::WallTime started_, last_quiet_warning_, last_pose_saved_, last_progress_;

  std::unique_ptr<CloudInput> clouds_;
  std::unique_ptr<GlobalWorker> global_worker_;
  std::unique_ptr<MapSource> map_source_;
  ros::Subscriber initial_pose_subscriber_, imu_subscriber_;
  std::vector<ros::ServiceServer> services_;
  std::unique_ptr<LiveParameters> live_parameters_;
  ros::WallTimer tf_timer_, watch_timer_;
  std::unique_ptr<ros::AsyncSpinner> input_spinner_, service_spinner_;
  std::thread registration_thread_;
};

/// For a node that refuses to start: a latched status that says why, so that the reason is not only in the
/// log.
ros::Publisher publishRefusal(ros::NodeHandle node, const std::string& message);

}  // namespace ttsdf
