#include "ros/messages/conversions.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "ttsdf_localization/localization/pose_covariance.h"

namespace ttsdf {

namespace {

template <class Vector, class Quaternion>
Eigen::Isometry3d rigidMotion(const Vector& t, const Quaternion& q, const char* what) {
  const Eigen::Vector3d translation(t.x, t.y, t.z);
  const Eigen::Quaterniond rotation(q.w, q.x, q.y, q.z);
  if (!translation.allFinite() || !rotation.coeffs().allFinite()) {
    throw std::invalid_argument(std::string(what) + ": got numbers that are not finite");
  }
  const double length = rotation.norm();
  if (std::abs(length - 1.0) > 0.01) {
    std::ostringstream text;
    text << what << ": got a quaternion of length " << length << ", wanted 1";
    throw std::invalid_argument(text.str());
  }
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = rotation.normalized().toRotationMatrix();
  T.translation() = translation;
  return T;
}

template <class Quaternion>
void assignRotation(const Eigen::Isometry3d& T, Quaternion& message) {
  const Eigen::Quaterniond q(T.linear());
  const Eigen::Quaterniond unit = q.normalized();
  message.x = unit.x();
  message.y = unit.y();
  message.z = unit.z();
  message.w = unit.w();
}

template <class Vector>
void assignTranslation(const Eigen::Isometry3d& T, Vector& message) {
  message.x = T.translation().x();
  message.y = T.translation().y();
  message.z = T.translation().z();
}

using RowMajor6d = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

}  // namespace

geometry_msgs::Pose toPoseMessage(const Eigen::Isometry3d& T) {
  geometry_msgs::Pose pose;
  assignTranslation(T, pose.position);
  assignRotation(T, pose.orientation);
  return pose;
}

geometry_msgs::Transform toTransformMessage(const Eigen::Isometry3d& T) {
  geometry_msgs::Transform transform;
  assignTranslation(T, transform.translation);
  assignRotation(T, transform.rotation);
  return transform;
}

Eigen::Isometry3d fromMessage(const geometry_msgs::Pose& pose) {
  return rigidMotion(pose.position, pose.orientation, "pose");
}

Eigen::Isometry3d fromMessage(const geometry_msgs::Transform& transform) {
  return rigidMotion(transform.translation, transform.rotation, "transform");
}

boost::array<double, 36> toCovarianceMessage(const Matrix6d& covariance) {
  boost::array<double, 36> message;
  Eigen::Map<RowMajor6d>(message.data()) = swapCovarianceOrder(covariance);
  return message;
}

Matrix6d fromCovarianceMessage(const boost::array<double, 36>& message) {
  const Matrix6d covariance = Eigen::Map<const RowMajor6d>(message.data());
  if (!isCovariance(covariance)) {
    throw std::invalid_argument(
        "covariance: got a matrix that is not finite, symmetric and positive semi-definite, wanted a "
        "covariance");
  }
  return swapCovarianceOrder(covariance);
}

ttsdf_localization::TtSdfMap toMapMessage(std::vector<std::uint8_t> bytes, const std::string& frame_id) {
  const TtSdfMap map = deserialize(bytes.data(), bytes.size());
  return toMapMessage(map, std::move(bytes), frame_id);
}

ttsdf_localization::TtSdfMap toMapMessage(const TtSdfMap& map, std::vector<std::uint8_t> bytes,
                                          const std::string& frame_id) {
  ttsdf_localization::TtSdfMap message;
  message.header.frame_id = frame_id;
  message.map_id = fileInfo(bytes.data(), bytes.size()).map_id;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    message.dims[axis] = static_cast<std::uint32_t>(map.geometry.dims[static_cast<Eigen::Index>(axis)]);
  }
  message.ranks[0] = static_cast<std::uint32_t>(map.train.rank1());
  message.ranks[1] = static_cast<std::uint32_t>(map.train.rank2());
  message.voxel_size = map.geometry.voxel_size;
  message.file_bytes = bytes.size();
  message.field = name(map.kind);
  message.data = std::move(bytes);
  return message;
}

TtSdfMap fromMapMessage(const ttsdf_localization::TtSdfMap& message) {
  return deserialize(message.data.data(), message.data.size());
}

std::string withoutLeadingSlash(const std::string& frame_id) {
  return !frame_id.empty() && frame_id.front() == '/' ? frame_id.substr(1) : frame_id;
}

}  // namespace ttsdf
