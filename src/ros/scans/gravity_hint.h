#pragma once
// Which way is down in the frame of a scan: from a level frame, from an IMU, or from a parameter.

#include <sensor_msgs/Imu.h>
#include <tf2/buffer_core.h>

#include <mutex>
#include <optional>
#include <string>

#include "ros/parameters/localization_options.h"

namespace ttsdf {

class GravityHint {
 public:
  /// `buffer` must outlive this.
  GravityHint(const GravityOptions& options, const FrameOptions& frames, const tf2::BufferCore& buffer);

  bool wantsImu() const { return options_.gravity_source == "imu"; }
  /// An IMU at rest or moving gently. Why it was left out: its stamp cannot be compared with the clock; else
  /// empty.
  std::string add(const sensor_msgs::Imu& imu, const ros::Time& now);

  /// Unit vector in the sensor frame at `stamp`; empty if unknown.
  std::optional<Eigen::Vector3d> down(const std::string& sensor_frame, const ros::Time& stamp) const;

 private:
  std::optional<Eigen::Vector3d> rotated(const Eigen::Vector3d& direction, const std::string& from,
                                         const std::string& to, const ros::Time& stamp) const;

  const GravityOptions options_;
  const std::string level_frame_;
  const tf2::BufferCore& buffer_;
  mutable std::mutex mutex_;
  std::string imu_frame_;
  ros::Time imu_stamp_;
  Eigen::Vector3d imu_force_ =
      Eigen::Vector3d::Zero();  ///< low-passed specific force, points up at rest [m/s^2]
};

}  // namespace ttsdf
