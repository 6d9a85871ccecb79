#include "ros/poses/pose_input.h"

#include <exception>

#include "ros/messages/conversions.h"
#include "ros/messages/stamps.h"

namespace ttsdf {

namespace {

Eigen::Isometry3d toMapFrame(const tf2::BufferCore& buffer, const std::string& map, const std::string& frame,
                             const ros::Time& stamp) {
  if (!stamp.isZero()) {
    try {
      return fromMessage(buffer.lookupTransform(map, frame, stamp).transform);
    } catch (const std::exception&) {
      // The click is newer than the newest transform (or older than all): the newest one is the best there
      // is.
    }
  }
  return fromMessage(buffer.lookupTransform(map, frame, ros::Time(0)).transform);
}

}  // namespace

PoseRequest readPose(const geometry_msgs::PoseWithCovarianceStamped& message, const tf2::BufferCore& buffer,
                     const FrameOptions& frames, const std::string& source, const ros::Time& now) {
  PoseRequest request;
  request.stamp = message.header.stamp;
  request.guess.source = source;
  const std::string problem = stampProblem(request.stamp, now);
  if (!problem.empty()) {
    request.stamp = ros::Time();
    request.warning = source + ": " + problem + ", taken for now";
  }
  const Eigen::Isometry3d T_frame_base = fromMessage(message.pose.pose);
  const Matrix6d covariance = fromCovarianceMessage(message.pose.covariance);
  std::string frame = withoutLeadingSlash(message.header.frame_id);
  if (frame.empty()) {
    request.warning += (request.warning.empty() ? "" : "; ") + source +
                       ": the pose has no frame_id, taken for '" + frames.global_frame_id + "'";
    frame = frames.global_frame_id;
  }
  Eigen::Isometry3d T_map_frame = Eigen::Isometry3d::Identity();
  if (frame != frames.global_frame_id)
    T_map_frame = toMapFrame(buffer, frames.global_frame_id, frame, request.stamp);
  request.guess.T_map_base = T_map_frame * T_frame_base;
  Matrix6d turn = Matrix6d::Zero();  // perturbations are meant in the axes of the message's frame
  turn.topLeftCorner<3, 3>() = T_map_frame.linear();
  turn.bottomRightCorner<3, 3>() = T_map_frame.linear();
  request.guess.covariance = turn * covariance * turn.transpose();
  return request;
}

PoseRequest startPose(const StartPoseOptions& options) {
  PoseRequest request;
  request.guess.source = "start pose";
  request.guess.T_map_base.translation() << options.initial_pose_x, options.initial_pose_y,
      options.initial_pose_z;
  request.guess.T_map_base.linear() =
      (Eigen::AngleAxisd(options.initial_pose_yaw, Eigen::Vector3d::UnitZ()) *
       Eigen::AngleAxisd(options.initial_pose_pitch, Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(options.initial_pose_roll, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  return request;
}

PoseGuess withOdometry(const PoseRequest& request, const tf2::BufferCore& buffer,
                       const FrameOptions& frames) {
  PoseGuess guess = request.guess;
  if (request.stamp.isZero()) return guess;
  if (frames.odom_frame_id.empty()) {
    guess.stamp = request.stamp.toSec();
    return guess;
  }
  try {
    guess.T_odom_base = fromMessage(
        buffer.lookupTransform(frames.odom_frame_id, frames.base_frame_id, request.stamp).transform);
    guess.stamp = request.stamp.toSec();
  } catch (const std::exception&) {
    // Older or newer than the odometry kept, or that is no rigid motion: a start pose that is a little off is
    // better than none.
  }
  return guess;
}

}  // namespace ttsdf
