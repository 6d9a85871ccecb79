#pragma once
// Clouds of an analytic room and the TF that goes with them, for tests of nodes.

#include <geometry_msgs/TransformStamped.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <tf2_eigen/tf2_eigen.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "ttsdf_localization/simulation/depth_camera.h"
#include "ttsdf_localization/simulation/worlds.h"

namespace ttsdf {

inline DepthCameraOptions testCamera() {
  DepthCameraOptions options;
  options.width = 160;
  options.height = 120;
  options.fx = options.fy = 131.0;
  options.max_range = 4.0;
  return options;
}

/// `count` views from the middle of makeRoom(), all around, slightly down; camera frame = optical (z
/// forward).
inline std::vector<Eigen::Isometry3d> roomViews(int count) {
  std::vector<Eigen::Isometry3d> views;
  Eigen::Matrix3d R_base_camera;
  R_base_camera << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  for (int n = 0; n < count; ++n) {
    const double yaw = 2.0 * 3.14159265358979323846 * n / count;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() << 2.0 + 0.2 * std::cos(yaw), 1.5 + 0.2 * std::sin(yaw), 1.3;
    T.linear() =
        (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(0.25, Eigen::Vector3d::UnitY()))
            .toRotationMatrix() *
        R_base_camera;
    views.push_back(T);
  }
  return views;
}

/// Organised cloud as depth_image_proc makes it: NaN where there is no reading.
inline sensor_msgs::PointCloud2 organizedCloud(const DepthImage& image, const CameraIntrinsics& k,
                                               const std::string& frame_id, const ros::Time& stamp) {
  sensor_msgs::PointCloud2 cloud;
  cloud.header.frame_id = frame_id;
  cloud.header.stamp = stamp;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(1, "xyz");
  modifier.resize(image.depth.size());
  cloud.width = static_cast<std::uint32_t>(image.width);
  cloud.height = static_cast<std::uint32_t>(image.height);
  cloud.row_step = cloud.width * cloud.point_step;
  cloud.is_dense = false;
  sensor_msgs::PointCloud2Iterator<float> xyz(cloud, "x");
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u, ++xyz) {
      const float z = image.at(u, v);
      const bool reading = std::isfinite(z) && z > 0.0F;
      const float nan = std::numeric_limits<float>::quiet_NaN();
      xyz[0] = reading ? static_cast<float>((u - k.cx) / k.fx) * z : nan;
      xyz[1] = reading ? static_cast<float>((v - k.cy) / k.fy) * z : nan;
      xyz[2] = reading ? z : nan;
    }
  }
  return cloud;
}

inline geometry_msgs::TransformStamped stampedTransform(const Eigen::Isometry3d& T, const std::string& parent,
                                                        const std::string& child, const ros::Time& stamp) {
  geometry_msgs::TransformStamped message = tf2::eigenToTransform(T);
  message.header.frame_id = parent;
  message.header.stamp = stamp;
  message.child_frame_id = child;
  return message;
}

}  // namespace ttsdf
