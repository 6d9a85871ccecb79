#include "ros/scans/gravity_hint.h"

#include <algorithm>
#include <cmath>
#include <exception>

#include "ros/messages/conversions.h"
#include "ros/messages/stamps.h"

namespace ttsdf {

namespace {
constexpr double kImuTimeConstant = 0.5;  // [s]

std::string levelFrame(const GravityOptions& gravity, const FrameOptions& frames) {
  if (gravity.gravity_source == "auto") return frames.odom_frame_id;
  if (gravity.gravity_source == "frame") return gravity.gravity_frame_id;
  return {};
}
}  // namespace

GravityHint::GravityHint(const GravityOptions& options, const FrameOptions& frames,
                         const tf2::BufferCore& buffer)
    : options_(options), level_frame_(levelFrame(options, frames)), buffer_(buffer) {}

std::optional<Eigen::Vector3d> GravityHint::down(const std::string& sensor_frame,
                                                 const ros::Time& stamp) const {
  if (options_.gravity_source == "vector") {
    return Eigen::Vector3d(options_.gravity_x, options_.gravity_y, options_.gravity_z).normalized();
  }
  if (!level_frame_.empty()) return rotated(-Eigen::Vector3d::UnitZ(), level_frame_, sensor_frame, stamp);
  if (options_.gravity_source == "imu") {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (imu_frame_.empty() || imu_force_.norm() < 1.0) return std::nullopt;
    return rotated(-imu_force_.normalized(), imu_frame_, sensor_frame, ros::Time(0));
  }
  return std::nullopt;
}

std::string GravityHint::add(const sensor_msgs::Imu& imu, const ros::Time& now) {
  const auto& a = imu.linear_acceleration;
  const Eigen::Vector3d force(a.x, a.y, a.z);
  if (!force.allFinite()) return {};
  std::string problem = stampProblem(imu.header.stamp, now);
  if (!problem.empty()) return problem;
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::string frame = withoutLeadingSlash(imu.header.frame_id);
  const double seconds = secondsBetween(imu_stamp_, imu.header.stamp);
  const bool fresh = frame != imu_frame_ || seconds <= 0.0 || seconds > 10.0 * kImuTimeConstant;
  const double gain = fresh ? 1.0 : 1.0 - std::exp(-seconds / kImuTimeConstant);
  imu_force_ += gain * (force - imu_force_);
  imu_frame_ = frame;
  imu_stamp_ = imu.header.stamp;
  return {};
}

std::optional<Eigen::Vector3d> GravityHint::rotated(const Eigen::Vector3d& direction, const std::string& from,
                                                    const std::string& to, const ros::Time& stamp) const {
  try {
    return fromMessage(buffer_.lookupTransform(to, from, stamp).transform).linear() * direction;
  } catch (const std::exception&) {  // no transform, or one that is no rigid motion
    return std::nullopt;
  }
}

}  // namespace ttsdf
