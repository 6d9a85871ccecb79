#pragma once
// Depth images as ROS messages: image, calibration, organised cloud.

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>

#include "ttsdf_localization/frames/depth_image.h"

namespace ttsdf {

/// "16UC1": millimetres, 0 where there is no reading (readings beyond 65.535 m are none); "32FC1": metres,
/// NaN where there is none. Throws std::invalid_argument for another encoding.
sensor_msgs::Image toImageMessage(const DepthImage& image, const std::string& encoding,
                                  const std_msgs::Header& header);

/// An ideal pinhole camera: no distortion, no rectification.
sensor_msgs::CameraInfo toCameraInfo(const CameraIntrinsics& intrinsics, const std_msgs::Header& header);

/// One point per pixel, row by row, NaN where there is no reading.
sensor_msgs::PointCloud2 toOrganisedCloud(const DepthImage& image, const CameraIntrinsics& intrinsics,
                                          const std_msgs::Header& header);

}  // namespace ttsdf
