#pragma once
// Messages from the bytes of a fuzzer. roscpp's own reader is left out: it makes room for whatever length a
// message claims.

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace ttsdf::fuzz {

class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}
  /// 0 when the bytes have come to their end.
  template <class Number>
  Number number() {
    Number value{};
    if (left_ < sizeof(Number)) return value;
    std::memcpy(&value, data_, sizeof(Number));
    data_ += sizeof(Number);
    left_ -= sizeof(Number);
    return value;
  }
  std::vector<std::uint8_t> rest() const { return {data_, data_ + left_}; }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

/// The same the other way, for the corpus.
class Output {
 public:
  template <class Number>
  Output& number(Number value) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&value);
    bytes_.insert(bytes_.end(), bytes, bytes + sizeof(Number));
    return *this;
  }
  std::vector<std::uint8_t> with(const std::vector<std::uint8_t>& rest) {
    bytes_.insert(bytes_.end(), rest.begin(), rest.end());
    return bytes_;
  }

 private:
  std::vector<std::uint8_t> bytes_;
};

inline const std::vector<std::string> kFields{"x", "y", "z", "rgb", "intensity", ""};
inline const std::vector<std::string> kEncodings{"16UC1", "32FC1", "mono16", "rgb8", ""};
inline const std::vector<std::string> kFormats{"16UC1; compressedDepth", "32FC1; compressedDepth",
                                               "16UC1; compressedDepth rvl", "bgr8; jpeg compressed bgr8",
                                               ""};

template <class Index>
const std::string& chosen(const std::vector<std::string>& texts, Index index) {
  return texts[static_cast<std::size_t>(index) % texts.size()];
}

inline sensor_msgs::PointCloud2 readCloud(Input& in) {
  sensor_msgs::PointCloud2 cloud;
  cloud.height = in.number<std::uint32_t>();
  cloud.width = in.number<std::uint32_t>();
  cloud.point_step = in.number<std::uint32_t>();
  cloud.row_step = in.number<std::uint32_t>();
  cloud.is_bigendian = in.number<std::uint8_t>();
  cloud.fields.resize(in.number<std::uint8_t>() % 6);
  for (auto& field : cloud.fields) {
    field.name = chosen(kFields, in.number<std::uint8_t>());
    field.offset = in.number<std::uint32_t>();
    field.datatype = in.number<std::uint8_t>();
    field.count = 1;
  }
  cloud.data = in.rest();
  return cloud;
}

inline std::vector<std::uint8_t> bytesOf(const sensor_msgs::PointCloud2& cloud) {
  Output out;
  out.number(cloud.height).number(cloud.width).number(cloud.point_step).number(cloud.row_step);
  out.number(cloud.is_bigendian).number(static_cast<std::uint8_t>(cloud.fields.size()));
  for (std::uint8_t n = 0; n < cloud.fields.size(); ++n)
    out.number(n).number(cloud.fields[n].offset).number(cloud.fields[n].datatype);
  return out.with(cloud.data);
}

inline sensor_msgs::CameraInfo readInfo(Input& in) {
  sensor_msgs::CameraInfo info;
  for (std::uint32_t* value : {&info.width, &info.height, &info.binning_x, &info.binning_y,
                               &info.roi.x_offset, &info.roi.y_offset, &info.roi.width, &info.roi.height}) {
    *value = in.number<std::uint32_t>();
  }
  for (const std::size_t n : {0U, 2U, 5U, 6U}) info.P[n] = in.number<double>();
  return info;
}

inline void write(const sensor_msgs::CameraInfo& info, Output& out) {
  for (const std::uint32_t value : {info.width, info.height, info.binning_x, info.binning_y,
                                    info.roi.x_offset, info.roi.y_offset, info.roi.width, info.roi.height}) {
    out.number(value);
  }
  for (const std::size_t n : {0U, 2U, 5U, 6U}) out.number(info.P[n]);
}

inline sensor_msgs::Image readImage(Input& in) {
  sensor_msgs::Image image;
  image.width = in.number<std::uint32_t>();
  image.height = in.number<std::uint32_t>();
  image.step = in.number<std::uint32_t>();
  image.encoding = chosen(kEncodings, in.number<std::uint8_t>());
  image.is_bigendian = in.number<std::uint8_t>();
  image.data = in.rest();
  return image;
}

}  // namespace ttsdf::fuzz
