#include "ros/node/localization_output.h"

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/PointCloud2.h>

#include <cmath>

#include "ros/messages/cloud_conversion.h"
#include "ros/messages/conversions.h"
#include "ttsdf_localization/localization/pose_covariance.h"

namespace ttsdf {

namespace {
using Status = ttsdf_localization::LocalizationStatus;
constexpr double kPathPeriod = 0.5;  // [s] between two paths, which are long

/// Of a velocity taken from odometry: as uncertain as the odometry is, and never exact; of one taken from two
/// poses: as uncertain as the prediction without odometry. A covariance of zeros would be taken for "exact".
boost::array<double, 36> twistCovariance(const Vector6d& twist, bool odometry, const MotionOptions& motion) {
  const double turn = twist.head<3>().norm(), speed = twist.tail<3>().norm();
  double rotation = motion.velocity_rotation_noise, translation = motion.velocity_translation_noise;
  if (odometry) {
    rotation = std::hypot(motion.odometry_rotation_noise * turn,
                          motion.odometry_rotation_noise_per_metre * speed, 0.02);
    translation = std::hypot(motion.odometry_translation_noise * speed, 0.02);
  }
  return toCovarianceMessage(isotropicCovariance(rotation, translation));
}
}  // namespace

std::uint8_t statusState(LocalizerState state) {
  switch (state) {
    case LocalizerState::kNoMap:
      return Status::NO_MAP;
    case LocalizerState::kWaitingForPose:
      return Status::WAITING_FOR_POSE;
    case LocalizerState::kTracking:
      return Status::TRACKING;
    case LocalizerState::kDegraded:
      return Status::DEGRADED;
    case LocalizerState::kLost:
      return Status::LOST;
    case LocalizerState::kRelocalizing:
      return Status::RELOCALIZING;
  }
  return Status::ERROR;
}

const char* statusStateName(std::uint8_t state) {
  switch (state) {
    case Status::PAUSED:
      return "paused";
    case Status::ERROR:
      return "error";
    default:
      return name(static_cast<LocalizerState>(state));  // the other constants follow the library's order
  }
}

std::uint8_t statusReason(RejectionReason reason) {
  switch (reason) {
    case RejectionReason::kNone:
      return Status::REASON_NONE;
    case RejectionReason::kNotConverged:
      return Status::REASON_NOT_CONVERGED;
    case RejectionReason::kTooFewPoints:
      return Status::REASON_TOO_FEW_POINTS;
    case RejectionReason::kOutsideMap:
      return Status::REASON_OUTSIDE_MAP;
    case RejectionReason::kResidual:
      return Status::REASON_RESIDUAL;
    case RejectionReason::kInliers:
      return Status::REASON_INLIERS;
    case RejectionReason::kJump:
      return Status::REASON_JUMP;
    case RejectionReason::kDegenerate:
      return Status::REASON_DEGENERATE;
    case RejectionReason::kAmbiguous:
      return Status::REASON_AMBIGUOUS;
    case RejectionReason::kLowScore:
      return Status::REASON_LOW_SCORE;
    case RejectionReason::kCancelled:
      return Status::REASON_CANCELLED;
    case RejectionReason::kNoStartPose:
      return Status::REASON_NO_START_POSE;
    case RejectionReason::kNoMap:
      return Status::REASON_NO_MAP;
    case RejectionReason::kOldStamp:
      return Status::REASON_OLD_STAMP;
    case RejectionReason::kNoPrior:
      return Status::REASON_NO_TRANSFORM;
    case RejectionReason::kNoScan:
      return Status::REASON_NO_SCAN;
  }
  return Status::REASON_NONE;
}

Status toStatus(const LocalizationUpdate& update) {
  const RegistrationResult& r = update.registration;
  Status status;
  status.state = statusState(update.state);
  status.state_name = name(update.state);
  status.reason = statusReason(update.reason);
  status.message = update.message;
  status.pose_valid = update.pose_valid;
  if (!update.registered) return status;
  status.confidence = r.confidence;
  status.rms_residual = r.rms_residual;
  status.inlier_ratio = r.inlier_ratio;
  status.outside_ratio = r.outside_ratio;
  status.unknown_ratio = r.unknown_ratio;
  status.behind_ratio = r.behind_ratio;
  status.unmapped_ratio = r.unmappedRatio();
  status.score = r.score;
  status.points = static_cast<std::uint32_t>(r.points);
  status.iterations = static_cast<std::uint32_t>(r.iterations);
  status.milliseconds = r.milliseconds;
  status.jump_translation = update.jump_translation;
  status.jump_rotation = update.jump_rotation;
  for (Eigen::Index n = 0; n < 6; ++n) {
    status.hessian_eigenvalues[static_cast<std::size_t>(n)] = r.hessian_eigenvalues[n];
  }
  status.degenerate_directions = static_cast<std::uint8_t>(r.degenerate_directions);
  return status;
}

LocalizationOutput::LocalizationOutput(ros::NodeHandle& node, const LocalizationRosOptions& options)
    : frames_(options.frames), options_(options.output), motion_(options.localizer.motion) {
  pose_ = node.advertise<geometry_msgs::PoseWithCovarianceStamped>("pose", 5, true);
  odometry_ = node.advertise<nav_msgs::Odometry>("odometry", 20);
  status_ = node.advertise<Status>("status", 20, true);
  aligned_cloud_ = node.advertise<sensor_msgs::PointCloud2>("aligned_cloud", 1);
  path_publisher_ = node.advertise<nav_msgs::Path>("path", 1);
  path_.header.frame_id = frames_.global_frame_id;
}

void LocalizationOutput::publish(const Status& status) { status_.publish(status); }

geometry_msgs::PoseWithCovarianceStamped LocalizationOutput::poseMessage(const LocalizationUpdate& update,
                                                                         const ros::Time& stamp) const {
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header.stamp = stamp;
  message.header.frame_id = frames_.global_frame_id;
  message.pose.pose = toPoseMessage(update.T_map_base);
  message.pose.covariance = toCovarianceMessage(update.covariance);
  return message;
}

void LocalizationOutput::publish(const LocalizationUpdate& update, const LocalizerScan& scan,
                                 const ros::Time& stamp) {
  const geometry_msgs::PoseWithCovarianceStamped pose = poseMessage(update, stamp);
  pose_.publish(pose);

  nav_msgs::Odometry odometry;
  odometry.header = pose.header;
  odometry.child_frame_id = frames_.base_frame_id;
  odometry.pose = pose.pose;
  odometry.twist.twist.angular.x = update.twist[0];
  odometry.twist.twist.angular.y = update.twist[1];
  odometry.twist.twist.angular.z = update.twist[2];
  odometry.twist.twist.linear.x = update.twist[3];
  odometry.twist.twist.linear.y = update.twist[4];
  odometry.twist.twist.linear.z = update.twist[5];
  odometry.twist.covariance = twistCovariance(update.twist, scan.T_odom_base.has_value(), motion_);
  odometry_.publish(odometry);

  if (aligned_cloud_.getNumSubscribers() > 0) {
    const ScanPoints in_map = (update.T_map_sensor.linear().cast<float>() * scan.points).colwise() +
                              update.T_map_sensor.translation().cast<float>();
    aligned_cloud_.publish(toCloudMessage(in_map, pose.header));
  }
  geometry_msgs::PoseStamped plain;
  plain.header = pose.header;
  plain.pose = pose.pose.pose;
  publishPath(plain);
}

void LocalizationOutput::publishPath(const geometry_msgs::PoseStamped& pose) {
  if (path_publisher_.getNumSubscribers() == 0) {
    path_.poses.clear();
    return;
  }
  if (!path_.poses.empty()) {
    const auto& a = path_.poses.back().pose.position;
    const auto& b = pose.pose.position;
    if (std::hypot(a.x - b.x, a.y - b.y, a.z - b.z) < options_.path_spacing) return;
  }
  // Thinned by half when full: the whole way stays visible and memory stays bounded.
  if (path_.poses.size() >= static_cast<std::size_t>(options_.path_length)) {
    std::size_t kept = 0;
    for (std::size_t n = 0; n < path_.poses.size(); n += 2) path_.poses[kept++] = path_.poses[n];
    path_.poses.resize(kept);
  }
  path_.poses.push_back(pose);
  path_.header.stamp = pose.header.stamp;
  const ros::WallTime now = ros::WallTime::now();
  if ((now - last_path_).toSec() < kPathPeriod) return;
  last_path_ = now;
  path_publisher_.publish(path_);
}

void LocalizationOutput::clearPath() { path_.poses.clear(); }

}  // namespace ttsdf
