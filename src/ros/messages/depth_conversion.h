#pragma once
// Depth images -> points for the registration, without a cloud of the whole image between them.

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include "ros/messages/cloud_conversion.h"

namespace ttsdf {

/// Points of a rectified depth image (16UC1 or mono16 [mm], 32FC1 [m]; either byte order), sub-sampled as
/// convertCloud does it with the organised cloud that depth_image_proc would make; the same points, bit for
/// bit. camera_info may be of the whole sensor: its binning and region of interest are taken into account.
/// Throws std::invalid_argument.
ConvertedCloud convertDepth(const sensor_msgs::Image& image, const sensor_msgs::CameraInfo& info,
                            const CloudOptions& options);

/// The image in a message of compressed_depth_image_transport (PNG or RVL). Throws std::invalid_argument;
/// allocates no more than 16384 x 16384 pixels.
sensor_msgs::Image decompressDepth(const sensor_msgs::CompressedImage& message);

}  // namespace ttsdf
