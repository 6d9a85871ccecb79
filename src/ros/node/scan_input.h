#pragma once
// Clouds and depth images in, reduced scans out: what waits for transforms is small.

#include <ros/node_handle.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "ros/messages/cloud_conversion.h"
#include "ros/parameters/localization_options.h"
#include "ros/scans/clock_watch.h"
#include "ros/scans/scan_queue.h"

namespace ttsdf {

class ScanInput {
 public:
  struct Callbacks {
    /// A message is there; false: it is not wanted now.
    std::function<bool()> arrived;
    /// The stamps of a topic went back.
    std::function<void(const std::string& why)> time_jumped_back;
    std::function<void(QueuedScan scan)> ready;
    std::function<void(const std_msgs::Header& header, const std::string& message)> rejected;
  };

  /// Subscribes the topics of the options; callbacks run in the queue of `node`.
  ScanInput(ros::NodeHandle& node, const InputOptions& input, const CloudOptions& cloud, Callbacks callbacks);
  ~ScanInput();

  void setCloudOptions(const CloudOptions& options);
  /// Of the first topic, as it is subscribed.
  std::string topic() const;

 private:
  struct Topic;
  void subscribeCloud(ros::NodeHandle& node, const std::string& name);
  void subscribeDepth(ros::NodeHandle& node, const std::string& name);
  void onInfo(Topic& topic, const sensor_msgs::CameraInfoConstPtr& info);
  void onImage(Topic& topic, const sensor_msgs::ImageConstPtr& image);
  /// Checks the header and converts; whatever is wrong is rejected.
  void take(Topic& topic, const std_msgs::Header& header,
            const std::function<ConvertedCloud(const CloudOptions&)>& convert);

  const Callbacks callbacks_;
  mutable std::mutex mutex_;
  CloudOptions options_;
  std::vector<std::unique_ptr<Topic>> topics_;
};

/// Why a scan with this header cannot be used; empty: it can.
std::string headerProblem(const std_msgs::Header& header);

}  // namespace ttsdf
