#include "ros/demo/depth_messages.h"

#include <sensor_msgs/image_encodings.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <boost/endian/conversion.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

namespace ttsdf {

namespace {

constexpr bool kBigEndian = boost::endian::order::native == boost::endian::order::big;

std::uint16_t millimetres(float metres) {
  const float rounded = std::round(1000.0f * metres);
  return rounded > 0.0f && rounded <= 65535.0f ? static_cast<std::uint16_t>(rounded) : std::uint16_t{0};
}

float metresOrNan(float metres) { return metres > 0.0f ? metres : std::numeric_limits<float>::quiet_NaN(); }

/// Fills `data` with one value per pixel.
template <class Value, class Convert>
void fill(sensor_msgs::Image& message, const DepthImage& image, const Convert& convert) {
  message.step = static_cast<std::uint32_t>(image.width) * static_cast<std::uint32_t>(sizeof(Value));
  message.data.resize(image.depth.size() * sizeof(Value));
  std::uint8_t* out = message.data.data();
  for (const float depth : image.depth) {
    const Value value = convert(depth);
    std::memcpy(out, &value, sizeof(Value));
    out += sizeof(Value);
  }
}

}  // namespace

sensor_msgs::Image toImageMessage(const DepthImage& image, const std::string& encoding,
                                  const std_msgs::Header& header) {
  sensor_msgs::Image message;
  message.header = header;
  message.width = static_cast<std::uint32_t>(image.width);
  message.height = static_cast<std::uint32_t>(image.height);
  message.encoding = encoding;
  message.is_bigendian = kBigEndian;
  if (encoding == sensor_msgs::image_encodings::TYPE_16UC1) {
    fill<std::uint16_t>(message, image, millimetres);
  } else if (encoding == sensor_msgs::image_encodings::TYPE_32FC1) {
    fill<float>(message, image, metresOrNan);
  } else {
    throw std::invalid_argument("depth encoding: got '" + encoding + "', wanted 16UC1 or 32FC1");
  }
  return message;
}

sensor_msgs::CameraInfo toCameraInfo(const CameraIntrinsics& intrinsics, const std_msgs::Header& header) {
  sensor_msgs::CameraInfo info;
  info.header = header;
  info.width = static_cast<std::uint32_t>(intrinsics.width);
  info.height = static_cast<std::uint32_t>(intrinsics.height);
  info.distortion_model = "plumb_bob";
  info.D.assign(5, 0.0);
  info.K = {intrinsics.fx, 0.0, intrinsics.cx, 0.0, intrinsics.fy, intrinsics.cy, 0.0, 0.0, 1.0};
  info.R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  info.P = {intrinsics.fx, 0.0, intrinsics.cx, 0.0, 0.0, intrinsics.fy,
            intrinsics.cy, 0.0, 0.0,           0.0, 1.0, 0.0};
  return info;
}

sensor_msgs::PointCloud2 toOrganisedCloud(const DepthImage& image, const CameraIntrinsics& intrinsics,
                                          const std_msgs::Header& header) {
  sensor_msgs::PointCloud2 cloud;
  cloud.header = header;
  cloud.width = static_cast<std::uint32_t>(image.width);
  cloud.height = static_cast<std::uint32_t>(image.height);
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(1, "xyz");
  cloud.is_dense = false;
  const float inverse_fx = static_cast<float>(1.0 / intrinsics.fx),
              inverse_fy = static_cast<float>(1.0 / intrinsics.fy);
  const float cx = static_cast<float>(intrinsics.cx), cy = static_cast<float>(intrinsics.cy);
  // The iterator points at x; y and z follow it in the layout chosen above.
  sensor_msgs::PointCloud2Iterator<float> point(cloud, "x");
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u, ++point) {
      const float z = metresOrNan(image.at(u, v));
      point[0] = (static_cast<float>(u) - cx) * inverse_fx * z;
      point[1] = (static_cast<float>(v) - cy) * inverse_fy * z;
      point[2] = z;
    }
  }
  return cloud;
}

}  // namespace ttsdf
