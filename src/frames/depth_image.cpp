#include "ttsdf_localization/frames/depth_image.h"

#include <stdexcept>
#include <string>

namespace ttsdf {

namespace {

void checkArguments(const DepthImage& image, const CameraIntrinsics& intrinsics, int stride) {
  if (stride < 1)
    throw std::invalid_argument("toPoints: got stride " + std::to_string(stride) + ", wanted >= 1");
  checkFits(image, intrinsics);
}

}  // namespace

void checkFits(const DepthImage& image, const CameraIntrinsics& intrinsics) {
  const auto sizeText = [](int width, int height) {
    return std::to_string(width) + " x " + std::to_string(height);
  };
  if (image.width < 1 || image.height < 1 ||
      image.depth.size() != static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
    throw std::invalid_argument("depth image: got " + std::to_string(image.depth.size()) + " values for " +
                                sizeText(image.width, image.height) + " pixels");
  }
  if (image.width != intrinsics.width || image.height != intrinsics.height) {
    throw std::invalid_argument("depth image: got " + sizeText(image.width, image.height) +
                                " pixels, wanted the intrinsics' " +
                                sizeText(intrinsics.width, intrinsics.height));
  }
  const auto& k = intrinsics;
  if (!std::isfinite(k.fx) || !std::isfinite(k.fy) || !std::isfinite(k.cx) || !std::isfinite(k.cy) ||
      k.fx == 0.0 || k.fy == 0.0) {
    throw std::invalid_argument("camera intrinsics: got fx " + std::to_string(k.fx) + ", fy " +
                                std::to_string(k.fy) + ", cx " + std::to_string(k.cx) + ", cy " +
                                std::to_string(k.cy) +
                                ", wanted finite values and focal lengths other than 0");
  }
}

Eigen::Matrix3Xf toPoints(const DepthImage& image, const CameraIntrinsics& intrinsics, int stride,
                          double min_depth, double max_depth) {
  checkArguments(image, intrinsics, stride);
  const auto columns = static_cast<Eigen::Index>((image.width + stride - 1) / stride);
  const auto rows = static_cast<Eigen::Index>((image.height + stride - 1) / stride);
  Eigen::Matrix3Xf points(3, columns * rows);
  Eigen::Index count = 0;
  for (int v = 0; v < image.height; v += stride) {
    const double y = (v - intrinsics.cy) / intrinsics.fy;
    for (int u = 0; u < image.width; u += stride) {
      const double z = image.at(u, v);
      // Written so that NaN fails too; 0 is "no reading" even where min_depth is 0.
      if (!(z > 0.0 && z >= min_depth && z <= max_depth)) continue;
      points.col(count++) = Eigen::Vector3d((u - intrinsics.cx) / intrinsics.fx * z, y * z, z).cast<float>();
    }
  }
  points.conservativeResize(Eigen::NoChange, count);
  return points;
}

}  // namespace ttsdf
