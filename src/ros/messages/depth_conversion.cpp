#include "ros/messages/depth_conversion.h"

#include <sensor_msgs/image_encodings.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

namespace ttsdf {

namespace {

namespace encodings = sensor_msgs::image_encodings;

[[noreturn]] void unusable(const std::string& what) { throw std::invalid_argument(what); }

std::string sizeText(std::size_t width, std::size_t height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

/// Of the image as it is: camera_info speaks of the whole sensor, an image may be a part of it, and binned.
struct Camera {
  float cx, cy;
  double fx, fy;
};

/// Refuses intrinsics that no depth camera has: numbers of another camera, or memory that was never written.
/// The limits are wide. The principal point may lie far outside an image that is a part of a larger one, so
/// it is limited by the angle to the image, not by the image's size.
void checkIntrinsics(const sensor_msgs::CameraInfo& info, double fx, double fy, double cx, double cy) {
  constexpr double kShortest = 0.05, kLongest = 50.0;  // focal lengths in widths or heights of the sensor
  constexpr double kFarthest =
      10.0;  // focal lengths from the image's centre to the principal point: 84 degrees
  const double width = info.width, height = info.height;
  const double longer = std::max(width, height);
  if (std::min(fx, fy) < kShortest * longer || std::max(fx, fy) > kLongest * longer) {
    unusable("camera_info: got the focal lengths " + toString(fx) + " and " + toString(fy) + " for " +
             sizeText(info.width, info.height) + " pixels, wanted from " + toString(kShortest * longer) +
             " to " + toString(kLongest * longer) + " pixels");
  }
  if (std::abs(cx - 0.5 * width) > kFarthest * fx || std::abs(cy - 0.5 * height) > kFarthest * fy) {
    unusable("camera_info: got the principal point " + toString(cx) + ", " + toString(cy) + " of " +
             sizeText(info.width, info.height) + " pixels, wanted it at most " + toString(kFarthest) +
             " focal lengths (" + toString(kFarthest * fx) + " and " + toString(kFarthest * fy) +
             " pixels) from the image's centre");
  }
}

Camera cameraOf(const sensor_msgs::Image& image, const sensor_msgs::CameraInfo& info) {
  const std::size_t binning_x = std::max(1U, info.binning_x), binning_y = std::max(1U, info.binning_y);
  const auto& roi = info.roi;
  const bool part = roi.width > 0 && roi.height > 0;
  const std::size_t width = (part ? roi.width : info.width) / binning_x;
  const std::size_t height = (part ? roi.height : info.height) / binning_y;
  if (width != image.width || height != image.height) {
    unusable("camera_info: got " + sizeText(info.width, info.height) + " with a region of interest of " +
             sizeText(roi.width, roi.height) + " and binning " + sizeText(binning_x, binning_y) +
             ", which makes " + sizeText(width, height) + ", wanted the size of the depth image, " +
             sizeText(image.width, image.height));
  }
  // P is of the rectified image; drivers that rectify nothing sometimes fill in K only.
  const bool has_p = info.P[0] != 0.0 || info.P[5] != 0.0;
  double fx = has_p ? info.P[0] : info.K[0], fy = has_p ? info.P[5] : info.K[4];
  double cx = has_p ? info.P[2] : info.K[2], cy = has_p ? info.P[6] : info.K[5];
  if (!(fx > 0.0 && fy > 0.0) || !std::isfinite(fx + fy + cx + cy)) {
    unusable("camera_info: got the focal lengths " + std::to_string(fx) + " and " + std::to_string(fy) +
             ", wanted them above 0");
  }
  checkIntrinsics(info, fx, fy, cx, cy);
  if (part) {
    cx -= roi.x_offset;
    cy -= roi.y_offset;
  }
  const auto bx = static_cast<double>(binning_x), by = static_cast<double>(binning_y);
  return {static_cast<float>(cx / bx), static_cast<float>(cy / by), fx / bx, fy / by};
}

template <class Value>
Value readPixel(const std::uint8_t* bytes, bool swap) {
  std::uint8_t raw[sizeof(Value)];
  std::memcpy(raw, bytes, sizeof(Value));
  if (swap) std::reverse(raw, raw + sizeof(Value));
  Value value;
  std::memcpy(&value, raw, sizeof(Value));
  return value;
}

bool hasReading(std::uint16_t depth) { return depth != 0; }
bool hasReading(float depth) { return std::isfinite(depth) && depth > 0.0F; }

template <class Value>
void readPoints(const sensor_msgs::Image& image, const Camera& camera, float metres_per_unit,
                const CloudOptions& options, ConvertedCloud& result) {
  const Stride stride = chooseStride(image.width, image.height, options.max_points);
  const bool swap = (image.is_bigendian != 0) != hostIsBigEndian();
  const auto x_scale = static_cast<float>(metres_per_unit / camera.fx);
  const auto y_scale = static_cast<float>(metres_per_unit / camera.fy);
  PointFilter filter(options, result);
  for (std::size_t v = 0; v < image.height; v += stride.row) {
    const std::uint8_t* row = image.data.data() + v * image.step;
    for (std::size_t u = 0; u < image.width; u += stride.column) {
      const auto depth = readPixel<Value>(row + u * sizeof(Value), swap);
      if (!hasReading(depth)) {
        filter.skip();
        continue;
      }
      const auto d = static_cast<float>(depth);
      filter.add((static_cast<float>(u) - camera.cx) * d * x_scale,
                 (static_cast<float>(v) - camera.cy) * d * y_scale, d * metres_per_unit);
    }
  }
}

}  // namespace

ConvertedCloud convertDepth(const sensor_msgs::Image& image, const sensor_msgs::CameraInfo& info,
                            const CloudOptions& options) {
  ConvertedCloud result;
  const bool millimetres = image.encoding == encodings::TYPE_16UC1 || image.encoding == encodings::MONO16;
  if (!millimetres && image.encoding != encodings::TYPE_32FC1)
    unusable("depth image: got encoding '" + image.encoding + "', wanted 16UC1 or 32FC1");
  if (image.width == 0 || image.height == 0) return result;
  const std::size_t bytes = millimetres ? 2 : 4;
  if (image.step < std::size_t{image.width} * bytes ||
      image.data.size() < (std::size_t{image.height} - 1) * image.step + std::size_t{image.width} * bytes) {
    unusable("depth image: got " + std::to_string(image.data.size()) + " bytes in rows of " +
             std::to_string(image.step) + ", wanted " + sizeText(image.width, image.height) + " pixels of " +
             std::to_string(bytes) + " bytes");
  }
  const Camera camera = cameraOf(image, info);
  if (millimetres) {
    readPoints<std::uint16_t>(image, camera, 0.001F, options, result);
  } else {
    readPoints<float>(image, camera, 1.0F, options, result);
  }
  return result;
}

}  // namespace ttsdf
