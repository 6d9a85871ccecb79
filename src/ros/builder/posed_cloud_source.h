#pragma once
// Clouds with the pose of their sensor in the map: waits for TF in the queue that the localizer has, too, and
// selects the clouds that are fused.

#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "ros/scans/clock_watch.h"
#include "ros/scans/scan_queue.h"
#include "ros/scans/scan_selector.h"
#include "ros/scans/transform_input.h"

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
  /// Counts of 0; waiting clouds and transforms (static ones apart) are forgotten, selection starts anew, and
  /// earlier stamps may follow. Any thread.
  void reset();

 private:
  void onCloud(const sensor_msgs::PointCloud2ConstPtr& cloud);
  void processQueue();
  void handle(const QueuedScan& scan);
  void reject(const std::string& frame_id, const std::string& why);

  const std::string global_frame_id_;
  const Callback callback_;
  tf2::BufferCore buffer_;
  ScanQueue queue_;

  mutable std::mutex mutex_;
  ClockWatch stamps_;
  ScanSelector selector_;
  Counts counts_;

  // Last: their callbacks use what is above, so they go first.
  std::unique_ptr<TransformInput> transforms_;
  ros::Subscriber subscriber_;
  ros::WallTimer timer_;
};

}  // namespace ttsdf
