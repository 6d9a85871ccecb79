#pragma once
// What the localizer does while it runs: scans from the queue into the localizer, results out as topics and
// TF.
//
// One lock and one thread. The thread takes the lock, takes a scan, works on it and publishes what came of
// it; everything else that changes the pose (a map, a pose from outside, a reset, a time jump, a pause, time
// going by) is an event that takes the same lock. So no scan from before an event can speak after it, and
// state, status and TF always agree. Scans and transforms come in without that lock: they never wait for the
// registration.

#include <std_msgs/Header.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "ros/maps/map_source.h"
#include "ros/node/global_worker.h"
#include "ros/node/localization_output.h"
#include "ros/node/tf_output.h"
#include "ros/scans/scan_localizer.h"
#include "ttsdf_localization/GlobalLocalization.h"
#include "ttsdf_localization/LocalizationStatus.h"
#include "ttsdf_localization/Relocalize.h"

namespace ttsdf {

/// Scans since the start, wherever they ended.
struct ScanCounts {
  std::uint32_t received = 0;       ///< messages that came in
  std::uint32_t unreadable = 0;     ///< of them no scan, or with a bad header
  std::uint32_t untransformed = 0;  ///< transforms missing
  std::uint32_t dropped = 0;        ///< overtaken by newer ones, or thrown away by a reset or a time jump
  std::uint32_t skipped = 0;        ///< not needed: max_rate, update_min_*
  std::uint32_t rejected = 0;       ///< without a pose, whatever the reason
  ros::WallTime last_arrival, last_taken;  ///< zero: never
};

/// Global localization in more maps than the one in use. With `find` all of them are needed, but for
/// `remark`.
struct WiderSearch {
  /// `goes_on`: a scan of the same drive as the ones before, which were not decided by themselves.
  std::function<RegistrationResult(const LocalizerScan& scan, const std::optional<Eigen::Vector3d>& gravity,
                                   bool goes_on, const ProgressCallback& progress)>
      find;
  /// Puts the maps around the place found into use; false: cancelled, or they cannot be had.
  std::function<bool(const Eigen::Vector3d& p_map, const ProgressCallback& progress)> loadAround;
  /// What the last search has to say beside its result; may be empty.
  std::function<std::string()> remark;
  /// The last find() has not decided, but scans of a drive from there on may.
  std::function<bool()> may_go_on;
  /// No scan of this drive comes any more; never while find() runs.
  std::function<void()> forget;
};

/// Thread-safe.
class LocalizationPipeline {
 public:
  using Status = ttsdf_localization::LocalizationStatus;

  LocalizationPipeline(ros::NodeHandle& node, const LocalizationRosOptions& options, const std::string& name);
  /// Ends the thread and a global localization; nothing is published afterwards.
  ~LocalizationPipeline();
  /// Waits in services come to an end; called before the services are shut down.
  void stop();

  // What comes in, without the lock.
  tf2::BufferCore& buffer() { return localizer_.buffer(); }
  GravityHint& gravity() { return localizer_.gravity(); }
  void addTransforms(const tf2_msgs::TFMessage& message, const std::string& authority, bool is_static);
  void noteArrival();
  void addScan(QueuedScan scan);
  /// A scan that could not be read.
  void rejectScan(const std_msgs::Header& header, const std::string& message);

  // Events: localization_pipeline_events.cpp.
  void useMap(LoadedMap map, std::optional<PoseRequest> pose = {});
  void usePose(PoseRequest request);
  void setPaused(bool paused);
  void reset(std::optional<PoseRequest> start);
  void timeJumpedBack(const std::string& why);
  void requestUpdate();
  void setOptions(const LocalizationRosOptions& options);
  /// Replaces the search in the map in use (an empty one: back to that). A search that runs is cancelled and
  /// awaited.
  void setWiderSearch(WiderSearch search);
  /// A status for what has nothing to do with a scan.
  void publishEvent(std::uint8_t reason, const std::string& message);
  /// Time goes by; called some times a second. `scans_waiting`: why scans do not get on, to be said in the
  /// status.
  void tick(const std::string& scans_waiting);
  void sendTransform() { tf_output_.tick(ros::Time::now()); }

  // Services. Throw std::runtime_error with the reason.
  ttsdf_localization::TtSdfMap map() const;
  void relocalize(const std::optional<PoseRequest>& around,
                  ttsdf_localization::Relocalize::Response& response);
  void globalLocalization(const ttsdf_localization::GlobalLocalization::Request& request,
                          ttsdf_localization::GlobalLocalization::Response& response);

  // What is known.
  struct View {
    Status status;  ///< the last one published, with the state as it is now
    ScanCounts scans;
    std::string map_summary;
    bool tf_wanted = true, tf_sent = false;
    double tf_age = 0.0;  ///< clock - stamp of the last transform sent [s]; negative: ahead of the clock
    std::string tf_frames;
    bool paused = false;
  };
  View view() const;
  std::optional<PoseGuess> trackedPose() const;
  /// Where the robot is, or where somebody said it is: there maps are needed.
  std::optional<Eigen::Vector3d> robotPosition();
  std::string whyWaiting() const { return localizer_.queue().whyWaiting(); }

 private:
  struct SeenScan {
    std_msgs::Header header;
    LocalizerScan scan;
    ros::WallTime taken;
  };

  // localization_pipeline.cpp: the way of a scan.
  void run();
  bool processNext();
  void handle(ScanOutcome outcome);
  void publishUpdate(const LocalizationUpdate& update, const SeenScan& seen);
  void warnLeftOut(const std::string& transform);
  void publishStatus(Status status, const ros::Time& stamp, bool of_a_scan);
  Status currentStatus() const;
  double secondsSinceLastLook();

  // localization_pipeline_events.cpp
  std::string awaitedInputs() const;

  // localization_pipeline_global.cpp
  void startGlobal(const SeenScan& seen, bool goes_on);
  bool hasDrivenOn(const LocalizationUpdate& update, const LocalizerScan& scan) const;
  void noteUndecided(const GlobalJob& job);
  void forgetUndecided();
  void runGlobal(GlobalJob& job, const ProgressCallback& progress);
  void onGlobalProgress(double share);
  void onGlobalDone(const GlobalJob& job);
  std::uint64_t orderGlobal(bool wait);
  void awaitPose(std::uint64_t order, ttsdf_localization::GlobalLocalization::Response& response);
  void checkConfirming(std::uint64_t order, const ros::WallTime& deadline) const;
  std::string whyNoScan() const;

  const std::string name_;
  const FrameOptions frames_;
  const std::string scan_topics_;
  TfOutput tf_output_;

  mutable std::mutex mutex_;  ///< guards everything down to the counts
  ScanLocalizer localizer_;
  LocalizationOutput output_;
  std::optional<SeenScan> newest_scan_;
  std::string map_id_, map_summary_;
  std::optional<Eigen::Vector3d> place_;  ///< where the robot was last, or was said or found to be [m]
  WiderSearch wider_search_;
  /// Where the odometry was at the last scan, while a search in many maps is not decided.
  std::optional<Eigen::Isometry3d> T_odom_undecided_;
  bool search_goes_on_ = false;  ///< the search that runs is part of the one before
  bool search_runs_ = false;     ///< its scans are still in use
  std::optional<ttsdf_localization::TtSdfMap> map_message_;
  std::optional<LocalizationUpdate> global_outcome_;  ///< of the last global localization
  std::optional<geometry_msgs::PoseWithCovarianceStamped>
      pose_since_global_;     ///< newest published since it began
  std::uint64_t orders_ = 0;  ///< poses asked for so far: who waits for one notices that another is wanted
  std::condition_variable status_changed_;
  Status status_;  ///< last one published
  bool paused_ = false;
  ros::WallTime last_progress_, last_waiting_status_;
  ros::Time last_look_;
  std::chrono::steady_clock::time_point last_steady_look_ = std::chrono::steady_clock::now();

  ros::WallTime last_left_out_;  ///< of the thread that adds transforms

  mutable std::mutex counts_mutex_;  ///< never held while another one is taken
  ScanCounts counts_;

  std::atomic<bool> stopping_{false};
  std::mutex work_mutex_;
  std::condition_variable work_;
  bool work_waits_ = false;
  std::unique_ptr<GlobalWorker> global_worker_;
  std::chrono::steady_clock::time_point busy_since_;  ///< the thread's own; zero: it is not
  std::thread thread_;
};

}  // namespace ttsdf
