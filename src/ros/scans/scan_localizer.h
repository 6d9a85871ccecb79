#pragma once
// The scan's way without clock, threads or publishers: queue, transforms, localizer. The node and the offline
// localizer run the same class, so that live and offline give the same poses from the same messages.

#include <tf2_msgs/TFMessage.h>

#include <map>
#include <optional>
#include <string>

#include "ros/parameters/localization_options.h"
#include "ros/poses/pose_input.h"
#include "ros/scans/gravity_hint.h"
#include "ros/scans/scan_queue.h"
#include "ttsdf_localization/localization/localizer.h"

namespace ttsdf {

/// What came of one scan.
struct ScanOutcome {
  enum class Kind {
    kLocalized,  ///< the localizer saw it: `update`
    kSkipped,    ///< the robot has not moved enough, or max_rate is kept
    kOvertaken,  ///< newer scans came faster than they were taken
    kOld,        ///< not newer than the one before: `update`
    kRejected    ///< its transforms are missing or broken: `message`
  };
  Kind kind = Kind::kLocalized;
  std_msgs::Header header;
  LocalizerScan scan;  ///< kLocalized
  LocalizationUpdate update;
  std::string message;
};

/// What came of a message of transforms.
struct TransformsOutcome {
  bool jumped_back = false;  ///< their stamps went back: tf refuses them for being too old
  int left_out = 0;          ///< whose stamps cannot be compared with the clock
  std::string why;           ///< of the last one left out
};

/// Not thread-safe, but for queue() and buffer(), which are.
class ScanLocalizer {
 public:
  /// `options` as checkAndTidy leaves them.
  explicit ScanLocalizer(const LocalizationRosOptions& options);

  tf2::BufferCore& buffer() { return buffer_; }
  ScanQueue& queue() { return queue_; }
  const ScanQueue& queue() const { return queue_; }
  GravityHint& gravity() { return gravity_; }
  Localizer& localizer() { return localizer_; }
  const Localizer& localizer() const { return localizer_; }

  /// In one thread.
  TransformsOutcome addTransforms(const tf2_msgs::TFMessage& message, const std::string& authority,
                                  bool is_static, const ros::Time& now);

  /// Works on the next scan of the queue; empty: none can be used yet. `newest`: older ones are passed over.
  std::optional<ScanOutcome> next(const ros::Time& now, bool newest = false, bool at_end = false);
  /// So much time went by [s]; before next(), so that no time from before a scan counts as silence after it.
  void advanceTime(double seconds);
  /// What changes where no scan comes.
  std::optional<LocalizationUpdate> checkSilence();

  /// A pose from outside; the motion since its stamp is added when a scan comes.
  void usePose(PoseRequest request);
  /// Another pose is searched instead.
  void dropPoseRequest() { pose_request_.reset(); }
  /// Pose and motion forgotten, map kept.
  void reset();
  /// The clock went back: transforms and scans of the time that was undone are forgotten.
  void timeJumpedBack();
  /// The next scan is used even if the robot stands still.
  void requestUpdate() { update_requested_ = true; }
  void setOptions(const LocalizationRosOptions& options);

 private:
  bool isTooOld(const geometry_msgs::TransformStamped& transform) const;
  LocalizerScan withTransforms(const QueuedScan& scan, bool odometry) const;
  bool mayBeSkipped(const LocalizerScan& scan) const;
  void noteUsed(const LocalizerScan& scan);

  FrameOptions frames_;
  UpdateOptions update_;
  const bool external_prior_;
  tf2::BufferCore buffer_;
  std::map<std::string, int>
      old_transforms_;  ///< rejected in a row, by child frame; of the thread that adds them
  ScanQueue queue_;
  GravityHint gravity_;
  Localizer localizer_;
  std::optional<PoseRequest> pose_request_;
  bool update_requested_ = false;
  double last_stamp_ = 0.0, usual_interval_ = 0.0;  ///< [s] of the scans taken
  double silence_ = 0.0;                            ///< [s] since a scan was used
  std::optional<double> last_used_stamp_;
  std::optional<Eigen::Isometry3d> T_odom_base_used_;  ///< of the last scan used
};

}  // namespace ttsdf
