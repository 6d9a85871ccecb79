#pragma once
// Depth image and camera_info -> cloud with depth_image_proc's own conversion: the same points as its nodelet
// gives.

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>

namespace ttsdf {

/// Organised, NaN where there is no reading. 16UC1 [mm] or 32FC1 [m]. Throws std::invalid_argument for
/// another encoding, an image shorter than its size, or an info of another size or without focal length.
sensor_msgs::PointCloud2::Ptr toCloud(const sensor_msgs::ImageConstPtr& image,
                                      const sensor_msgs::CameraInfo& info);

}  // namespace ttsdf
