#pragma once
// Poses, covariances and maps between ROS messages and the library. The only place where the two orders of a
// covariance (ROS: translation first) meet is geometry/se3.h swapCovarianceOrder.

#include <geometry_msgs/Pose.h>
#include <geometry_msgs/PoseWithCovariance.h>
#include <geometry_msgs/Transform.h>

#include <boost/array.hpp>
#include <string>
#include <vector>

#include "ttsdf_localization/TtSdfMap.h"
#include "ttsdf_localization/geometry/se3.h"
#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {

geometry_msgs::Pose toPoseMessage(const Eigen::Isometry3d& T);
geometry_msgs::Transform toTransformMessage(const Eigen::Isometry3d& T);
/// Throws std::invalid_argument for numbers that are not finite or a quaternion far from unit length.
Eigen::Isometry3d fromMessage(const geometry_msgs::Pose& pose);
Eigen::Isometry3d fromMessage(const geometry_msgs::Transform& transform);

boost::array<double, 36> toCovarianceMessage(const Matrix6d& covariance);
/// Throws std::invalid_argument if it is not finite, not symmetric or not positive semi-definite.
Matrix6d fromCovarianceMessage(const boost::array<double, 36>& covariance);

/// The file's bytes and their summary. Throws MapFormatError for bytes that are no map.
ttsdf_localization::TtSdfMap toMapMessage(std::vector<std::uint8_t> bytes, const std::string& frame_id);
/// The same of a map that was decoded from them already.
ttsdf_localization::TtSdfMap toMapMessage(const TtSdfMap& map, std::vector<std::uint8_t> bytes,
                                          const std::string& frame_id);
/// Decodes and checks the bytes; the summary is not trusted. Throws MapFormatError.
TtSdfMap fromMapMessage(const ttsdf_localization::TtSdfMap& message);

/// "/map" -> "map": tf2 refuses leading slashes.
std::string withoutLeadingSlash(const std::string& frame_id);

}  // namespace ttsdf
