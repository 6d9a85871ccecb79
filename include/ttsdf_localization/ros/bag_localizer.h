#pragma once
// The localizer fed from a bag, message by message: what the node does, without a master, a clock or threads.
// Every scan is used, and the same bag gives the same result whatever the machine does meanwhile.

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "ttsdf_localization/LocalizationStatus.h"
#include "ttsdf_localization/localization/localizer.h"
#include "ttsdf_localization/ros/clock_watch.h"
#include "ttsdf_localization/ros/cloud_input.h"
#include "ttsdf_localization/ros/gravity_hint.h"
#include "ttsdf_localization/ros/localization_options.h"
#include "ttsdf_localization/ros/pose_input.h"

namespace ttsdf {

class BagLocalizer {
 public:
  using Status = ttsdf_localization::LocalizationStatus;
  /// A scan's outcome: the status as the node publishes it, and the pose where the status says pose_valid.
  using Report = std::function<void(const std_msgs::Header&, const Status&, const LocalizationUpdate&)>;

  /// `options` as checkAndTidy leaves them. The time limit of a global localization is lifted: how far it
  /// gets in a given time would depend on the machine.
  BagLocalizer(const LocalizationRosOptions& options, PreparedMap map, Report report);

  void add(const tf2_msgs::TFMessage& transforms, bool is_static);
  void add(const sensor_msgs::Imu& imu) { gravity_.add(imu); }
  void add(const geometry_msgs::PoseWithCovarianceStamped& initial_pose);
  void add(const sensor_msgs::PointCloud2& cloud);
  /// A scan that gave no cloud: counted and reported as refused.
  void addDamaged(const std_msgs::Header& header, const std::string& why);
  /// The bag has come to `time`: scans that have their transforms by now, or waited too long, are worked on.
  void advance(const ros::Time& time);
  /// The bag has ended: what waits goes on without what is missing.
  void finish();

  int globalLocalizations() const { return globals_; }
  /// Poses from outside that were refused, and why.
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  struct Waiting {
    CloudScan scan;
    ros::Time arrival;
  };
  enum class Transforms { kAll, kAllButOdometry, kMissing };

  Transforms transformsOf(const CloudScan& scan, std::string& why) const;
  bool tryFirst(bool at_end);
  void process(const CloudScan& scan, bool odometry);
  void runGlobal(const LocalizerScan& scan, const std_msgs::Header& header);
  void refuse(const std_msgs::Header& header, std::uint8_t reason, const std::string& message);
  void timeJumpedBack();

  const LocalizationRosOptions options_;
  const Report report_;
  tf2::BufferCore buffer_;
  GravityHint gravity_;
  ClockWatch clock_watch_;
  Localizer localizer_;
  std::deque<Waiting> waiting_;
  std::optional<PoseRequest> pose_request_;
  std::vector<std::string> warnings_;
  ros::Time now_;
  bool odometry_seen_ = false;
  int globals_ = 0;
};

}  // namespace ttsdf
