#pragma once
// initialpose and its relatives: checked, taken to the map frame, and moved on to the next scan by odometry.

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <tf2/buffer_core.h>

#include <string>

#include "ros/parameters/localization_options.h"
#include "ttsdf_localization/localization/localization_types.h"

namespace ttsdf {

/// A pose of the base from outside, in the map frame, with the time it was true (zero: now).
struct PoseRequest {
  PoseGuess guess;
  ros::Time stamp;
  std::string warning;  ///< empty, or what was odd about the message
};

/// Any frame (transformed at the message's stamp, else with the newest transform); an empty one is taken for
/// the map's and gives a warning, as does a stamp that cannot be compared with the clock, which is taken for
/// now. Throws std::invalid_argument for NaN, a zero quaternion or a bad
/// covariance, and tf2::TransformException for a frame without transform.
PoseRequest readPose(const geometry_msgs::PoseWithCovarianceStamped& message, const tf2::BufferCore& buffer,
                     const FrameOptions& frames, const std::string& source, const ros::Time& now);

/// Start pose of the parameters.
PoseRequest startPose(const StartPoseOptions& options);

/// Adds the odometry at the request's stamp, so that the motion since then counts; without it the pose is
/// taken to be true at the next scan.
PoseGuess withOdometry(const PoseRequest& request, const tf2::BufferCore& buffer, const FrameOptions& frames);

}  // namespace ttsdf
