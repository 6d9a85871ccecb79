#pragma once

#include <vector>

#include <Eigen/Core>

namespace ttsdf {

struct CameraIntrinsics {
  int width = 0, height = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  ///< [pixel]; fy may be negative (ICL-NUIM)
};

/// Depth along the optical axis [m], row-major; 0 or NaN: no reading.
struct DepthImage {
  int width = 0, height = 0;
  std::vector<float> depth;
  float at(int u, int v) const { return depth[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)]; }
};

/// Points of every `stride`-th pixel in both directions with a reading in [min_depth, max_depth], camera frame.
Eigen::Matrix3Xf toPoints(const DepthImage& image, const CameraIntrinsics& intrinsics, int stride, double min_depth,
                          double max_depth);

}  // namespace ttsdf
