#pragma once
// Everything the localizer publishes but TF: pose, odometry, status, and on demand aligned cloud and path.

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Path.h>
#include <ros/node_handle.h>

#include <string>

#include "ros/parameters/localization_options.h"
#include "ttsdf_localization/LocalizationStatus.h"
#include "ttsdf_localization/localization/localization_types.h"

namespace ttsdf {

/// States and reasons of the library as the message's constants.
std::uint8_t statusState(LocalizerState state);
std::uint8_t statusReason(RejectionReason reason);
const char* statusStateName(std::uint8_t state);

/// The figures of an update; counters and map are the caller's.
ttsdf_localization::LocalizationStatus toStatus(const LocalizationUpdate& update);

/// Not thread-safe but for ROS's own publishers: call under one lock.
class LocalizationOutput {
 public:
  LocalizationOutput(ros::NodeHandle& node, const LocalizationRosOptions& options);

  void publish(const ttsdf_localization::LocalizationStatus& status);
  /// Pose, odometry, path, aligned cloud of an update with a pose.
  void publish(const LocalizationUpdate& update, const LocalizerScan& scan, const ros::Time& stamp);
  /// A pose found by a search, before tracking has confirmed it: only for replies.
  geometry_msgs::PoseWithCovarianceStamped poseMessage(const LocalizationUpdate& update,
                                                       const ros::Time& stamp) const;
  void clearPath();

 private:
  void publishPath(const geometry_msgs::PoseStamped& pose);

  const FrameOptions frames_;
  const OutputOptions options_;
  const MotionOptions motion_;
  ros::WallTime last_path_;
  ros::Publisher pose_, odometry_, status_, aligned_cloud_, path_publisher_;
  nav_msgs::Path path_;
};

}  // namespace ttsdf
