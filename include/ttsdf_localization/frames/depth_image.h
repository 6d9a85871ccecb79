#pragma once

// Depth images and the pinhole camera that took them: plain data, shared with the simulation.

#include <Eigen/Core>
#include <vector>

namespace ttsdf {

struct CameraIntrinsics {
  int width = 0, height = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  ///< [pixel]; fy may be negative (ICL-NUIM)
};

/// Depth along the optical axis [m], row-major; 0 or NaN: no reading.
struct DepthImage {
  int width = 0, height = 0;
  std::vector<float> depth;
  float at(int u, int v) const {
    return depth[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)];
  }
};

/// Throws std::invalid_argument unless the image has width * height values, the intrinsics are of the same
/// size and finite, and the focal lengths differ from 0.
void checkFits(const DepthImage& image, const CameraIntrinsics& intrinsics);

/// Points of every `stride`-th pixel in both directions with a reading in [min_depth, max_depth], camera
/// frame. Throws std::invalid_argument for stride < 1 and as checkFits does.
Eigen::Matrix3Xf toPoints(const DepthImage& image, const CameraIntrinsics& intrinsics, int stride,
                          double min_depth, double max_depth);

}  // namespace ttsdf
