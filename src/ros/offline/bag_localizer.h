#pragma once
// The localizer fed from a bag, message by message: what the node does, without a master, a clock or threads.
// No scan is passed over for lack of time: max_rate and update_min_* alone skip scans, by their stamps and
// motions. So the same bag gives the same result whatever the machine does meanwhile.

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <sensor_msgs/Imu.h>
#include <tf2_msgs/TFMessage.h>

#include <functional>
#include <string>
#include <vector>

#include "ros/messages/cloud_conversion.h"
#include "ros/scans/clock_watch.h"
#include "ros/scans/scan_localizer.h"
#include "ttsdf_localization/LocalizationStatus.h"

namespace ttsdf {

class BagLocalizer {
 public:
  using Status = ttsdf_localization::LocalizationStatus;
  /// A scan's outcome: the status as the node publishes it, and the pose where the status says pose_valid.
  using Report = std::function<void(const std_msgs::Header&, const Status&, const LocalizationUpdate&)>;

  /// `options` as checkAndTidy leaves them. A global localization ends before the next message is read,
  /// however long it takes.
  BagLocalizer(const LocalizationRosOptions& options, PreparedMap map, Report report);

  void add(const tf2_msgs::TFMessage& transforms, bool is_static);
  void add(const sensor_msgs::Imu& imu);
  void add(const geometry_msgs::PoseWithCovarianceStamped& initial_pose);
  /// A cloud or a depth image; what `convert` throws is reported.
  void add(const std_msgs::Header& header, const std::function<ConvertedCloud(const CloudOptions&)>& convert);
  /// The bag has come to `time`: scans that have their transforms by now, or waited too long, are worked on.
  void advance(const ros::Time& time);
  /// The bag has ended: what waits goes on without what is missing.
  void processRemaining();

  int globalLocalizations() const { return globals_; }
  /// Poses from outside that were refused, and why; scans that hold nothing; messages that were left out.
  std::vector<std::string> warnings() const;

 private:
  void processScans(bool at_end);
  void report(const ScanOutcome& outcome);
  void runGlobal(const LocalizerScan& scan, const std_msgs::Header& header);
  void reject(const std_msgs::Header& header, std::uint8_t reason, const std::string& message);
  void timeJumpedBack();

  const LocalizationRosOptions options_;
  const Report report_;
  ScanLocalizer localizer_;
  ClockWatch clock_watch_;
  std::vector<std::string> warnings_;
  ros::Time now_;
  int globals_ = 0;
  struct LeftOut {
    int count = 0;
    std::string why;  ///< of the last one
  };
  LeftOut transforms_left_out_, imu_left_out_;
  int scans_without_points_ = 0, scans_without_readings_ = 0, scans_of_wrong_byte_order_ = 0;
};

}  // namespace ttsdf
