#pragma once
// An organised cloud made from a depth image (depth_image_proc) is that depth image again: fusing it
// projectively is faster and better than ray by ray, and a map built live then equals the one built from the
// image files.

#include <optional>
#include <utility>

#include "ttsdf_localization/frames/depth_image.h"

namespace ttsdf {

/// Recovers depth image and intrinsics from an organised cloud in the camera's optical frame (z forward),
/// row-major, NaN where there is no reading. The depth is the points' z, bit for bit, and 0 where that
/// is 65.535 m (a 16-bit image's other "no reading"). The intrinsics are fitted to x/z and y/z over all
/// points: good to about 1e-6 relative for single-precision clouds. Returns nothing if it is no pinhole
/// image: width * height differs from the number of points, a point behind the camera, a point more than 0.1
/// pixel off, or too few points or too small a part of the image to tell.
std::optional<std::pair<DepthImage, CameraIntrinsics>> pinholeFromCloud(const Eigen::Matrix3Xf& points,
                                                                        int width, int height);

}  // namespace ttsdf
