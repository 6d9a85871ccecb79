#pragma once
// Clouds with their sensor's pose in the map: topic + TF at each cloud's own stamp, and the selection of what
// is worth fusing. Survives bags that loop.

#include <message_filters/subscriber.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/message_filter.h>
#include <tf2_ros/transform_listener.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "ttsdf_localization/ros/scan_selector.h"

namespace ttsdf {

class PosedCloudSource {
 public:
  using Callback = std::function<void(const sensor_msgs::PointCloud2ConstPtr& cloud,
                                      const Eigen::Isometry3d& T_map_sensor)>;

  struct Counts {
    std::uint32_t received = 0, skipped = 0, without_transform = 0;
    std::string sensor_frame_id;       ///< of the newest cloud
    std::string last_transform_error;  ///< empty once a later cloud had its transform
    ros::WallTime last_received;       ///< zero: never
    ros::WallTime last_transformed;    ///< zero: never
  };

  /// Subscribes "cloud" of `nh`; `callback` runs in nh's callback queue for every selected cloud. At most
  /// `queue_size` clouds wait for TF. Throws std::invalid_argument for bad options.
  PosedCloudSource(ros::NodeHandle nh, const std::string& global_frame_id,
                   const ScanSelectionOptions& selection, int queue_size, Callback callback);
  ~PosedCloudSource();

  /// The resolved topic name, for messages.
  std::string topic() const { return subscriber_.getTopic(); }
  Counts counts() const;
  /// Counts of 0; waiting clouds and transforms (static ones apart) are forgotten, selection starts anew.
  void reset();

 private:
  using Filter = tf2_ros::MessageFilter<sensor_msgs::PointCloud2>;

  void watch(const sensor_msgs::PointCloud2ConstPtr& cloud);
  void handle(const sensor_msgs::PointCloud2ConstPtr& cloud);
  void handleFailure(const sensor_msgs::PointCloud2ConstPtr& cloud, const std::string& why);

  const std::string global_frame_id_;
  const Callback callback_;
  tf2_ros::Buffer buffer_;
  std::unique_ptr<tf2_ros::TransformListener> listener_;

  mutable std::mutex mutex_;
  ScanSelector selector_;
  Counts counts_;
  double newest_stamp_ = 0.0;  ///< [s]

  // Last: their callbacks use what is above, so they go first.
  message_filters::Subscriber<sensor_msgs::PointCloud2> subscriber_;
  Filter filter_;
};

}  // namespace ttsdf
