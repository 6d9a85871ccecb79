#pragma once
// Clouds in, reduced scans with their transforms out. A cloud is reduced as soon as it arrives, so that what
// waits for transforms is small.

#include <ros/node_handle.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>
#include <tf2_ros/buffer.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "ttsdf_localization/localization/localization_types.h"
#include "ttsdf_localization/ros/cloud_conversion.h"
#include "ttsdf_localization/ros/localization_options.h"

namespace ttsdf {

/// A reduced cloud that waits for its transforms.
struct CloudScan {
  std_msgs::Header header;
  ScanPoints points;  ///< sensor frame [m]
};

struct CloudCounts {
  std::uint32_t received = 0;       ///< clouds
  std::uint32_t unreadable = 0;     ///< refused before any transform was asked for
  std::uint32_t untransformed = 0;  ///< dropped because their transforms never came
  ros::Time last_stamp;             ///< of the newest cloud
  std::string frame_id;             ///< of the newest cloud
  ros::WallTime last_arrival;       ///< zero: none yet
  ros::WallTime last_ready;         ///< zero: none yet
};

/// Subscribes to `cloud`. Callbacks run on the queue of the node handle.
class CloudInput {
 public:
  struct Callbacks {
    /// A scan whose transforms are there (`odometry` false: all but the odometry's).
    std::function<void(const boost::shared_ptr<const CloudScan>&, bool odometry)> ready;
    /// A cloud that gives no scan; `reason` is one of LocalizationStatus.
    std::function<void(const std_msgs::Header&, std::uint8_t reason, const std::string& message)> refused;
    /// Called first for every cloud; false: ignore it (paused).
    std::function<bool(const std_msgs::Header&)> arrived;
  };

  CloudInput(ros::NodeHandle& node, tf2_ros::Buffer& buffer, const FrameOptions& frames,
             const CloudOptions& cloud, const std::string& prior, Callbacks callbacks);
  ~CloudInput();

  /// Forgets what waits (a time jump).
  void clear();
  /// For the clouds from now on.
  void setCloudOptions(const CloudOptions& options);
  CloudCounts counts() const;
  std::string topic() const;
  /// Frames a scan needs, besides its own.
  const std::vector<std::string>& targetFrames() const { return target_frames_; }
  /// Why the newest cloud still waits; empty if it does not.
  std::string whyWaiting() const;

 private:
  class Filter;
  void onCloud(const sensor_msgs::PointCloud2ConstPtr& cloud);
  void onReady(const boost::shared_ptr<const CloudScan>& scan);
  void onDropped(const boost::shared_ptr<const CloudScan>& scan, const std::string& why);
  bool hasTransforms(const CloudScan& scan) const;
  /// Whether a scan of the filter went on without it; forgets that.
  bool wasRescued(const boost::shared_ptr<const CloudScan>& scan);
  void noLongerWaiting(const std_msgs::Header& header);
  void goOnWithoutOdometry(const boost::shared_ptr<const CloudScan>& scan);
  std::string checkHeader(const std_msgs::Header& header) const;

  const FrameOptions frames_;
  const Callbacks callbacks_;
  tf2_ros::Buffer& buffer_;
  std::vector<std::string> target_frames_;
  bool uses_odometry_ = false;

  mutable std::mutex mutex_;
  CloudOptions cloud_options_;
  CloudCounts counts_;
  ros::Time last_ready_stamp_;               ///< newest scan with all its transforms; zero: none yet
  std::optional<std_msgs::Header> waiting_;  ///< newest cloud, while it waits for its transforms
  /// Scans that went on without the filter while it has them still; it drops them sooner or later.
  std::set<boost::shared_ptr<const CloudScan>> rescued_;
  ros::Time last_bridged_stamp_;  ///< newest scan that went on without odometry
  std::unique_ptr<Filter> filter_;
  ros::Subscriber subscriber_;
};

/// The transforms of a scan, as the localizer wants them. Throws tf2::TransformException.
LocalizerScan withTransforms(const CloudScan& scan, bool odometry, const tf2::BufferCore& buffer,
                             const FrameOptions& frames, const std::string& prior);

}  // namespace ttsdf

namespace ros::message_traits {
template <>
struct HasHeader<ttsdf::CloudScan> : TrueType {};
template <>
struct HasHeader<const ttsdf::CloudScan> : TrueType {};
}  // namespace ros::message_traits
