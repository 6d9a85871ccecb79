#pragma once
// Depth images of a plane wall, as they are and compressed: for the tests and as seeds of the fuzzers.

#include <png.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include <cstring>
#include <string>
#include <vector>

namespace ttsdf::test {

constexpr double kDepthFocal = 100.0, kDepthCx = 40.0, kDepthCy = 30.0;
constexpr std::uint32_t kDepthWidth = 80, kDepthHeight = 60;

/// A wall at z = 2 + 0.3 x - 0.2 y: every ray meets it in one known point.
inline double depthOf(double u, double v) {
  const double x = (u - kDepthCx) / kDepthFocal, y = (v - kDepthCy) / kDepthFocal;
  return 2.0 / (1.0 - 0.3 * x + 0.2 * y);
}

inline sensor_msgs::CameraInfo depthInfo() {
  sensor_msgs::CameraInfo info;
  info.width = kDepthWidth;
  info.height = kDepthHeight;
  info.K = {kDepthFocal, 0, kDepthCx, 0, kDepthFocal, kDepthCy, 0, 0, 1};
  info.P = {kDepthFocal, 0, kDepthCx, 0, 0, kDepthFocal, kDepthCy, 0, 0, 0, 1, 0};
  return info;
}

/// The part of the sensor from (x, y) on, every `bin`th pixel of it.
inline sensor_msgs::Image depthImage(std::uint32_t x, std::uint32_t y, std::uint32_t width,
                                     std::uint32_t height, std::uint32_t bin, bool millimetres = false) {
  sensor_msgs::Image image;
  image.width = width;
  image.height = height;
  image.encoding = millimetres ? "16UC1" : "32FC1";
  const std::uint32_t bytes = millimetres ? 2 : 4;
  image.step = width * bytes;
  image.data.resize(std::size_t{image.step} * height);
  for (std::uint32_t v = 0; v < height; ++v) {
    for (std::uint32_t u = 0; u < width; ++u) {
      const double depth = depthOf(x + bin * u, y + bin * v);
      const auto metres = static_cast<float>(depth);
      const auto raw = static_cast<std::uint16_t>(1000.0 * depth + 0.5);
      std::memcpy(&image.data[v * image.step + u * bytes],
                  millimetres ? static_cast<const void*>(&raw) : &metres, bytes);
    }
  }
  return image;
}

inline void appendPng(png_structp png, png_bytep bytes, png_size_t size) {
  auto& out = *static_cast<std::vector<std::uint8_t>*>(png_get_io_ptr(png));
  out.insert(out.end(), bytes, bytes + size);
}

/// As compressed_depth_image_transport writes it.
inline sensor_msgs::CompressedImage compressedPng(const std::vector<std::uint16_t>& values,
                                                  const std::string& encoding, float a = 0.0F,
                                                  float b = 0.0F) {
  sensor_msgs::CompressedImage message;
  message.format = encoding + "; compressedDepth";
  message.data.resize(12);
  std::memcpy(&message.data[4], &a, 4);
  std::memcpy(&message.data[8], &b, 4);
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(png, &message.data, appendPng, nullptr);
  png_set_IHDR(png, info, kDepthWidth, kDepthHeight, 16, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  png_set_swap(png);
  for (std::uint32_t v = 0; v < kDepthHeight; ++v) {
    auto row =
        std::vector<std::uint16_t>(values.begin() + v * kDepthWidth, values.begin() + (v + 1) * kDepthWidth);
    png_write_row(png, reinterpret_cast<png_bytep>(row.data()));
  }
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return message;
}

inline std::vector<std::uint16_t> depthMillimetres() {
  const sensor_msgs::Image source = depthImage(0, 0, kDepthWidth, kDepthHeight, 1, true);
  std::vector<std::uint16_t> values(source.data.size() / 2);
  std::memcpy(values.data(), source.data.data(), source.data.size());
  for (std::size_t n = 0; n < 50; ++n) values[n] = 0;
  return values;
}

/// Wilson's code of values, in words of eight groups.
inline sensor_msgs::CompressedImage compressedRvl(const std::vector<std::uint16_t>& values) {
  sensor_msgs::CompressedImage message;
  message.format = "16UC1; compressedDepth rvl";
  message.data.resize(12 + 8);
  std::memcpy(&message.data[12], &kDepthWidth, 4);
  std::memcpy(&message.data[16], &kDepthHeight, 4);
  std::vector<std::uint32_t> groups;
  const auto put = [&](std::uint32_t value) {
    do {
      const std::uint32_t low = value & 7U;
      value >>= 3;
      groups.push_back(low | (value ? 8U : 0U));
    } while (value);
  };
  std::int32_t previous = 0;
  for (std::size_t n = 0; n < values.size();) {
    std::size_t zeros = n;
    while (zeros < values.size() && values[zeros] == 0) ++zeros;
    std::size_t end = zeros;
    while (end < values.size() && values[end] != 0) ++end;
    put(static_cast<std::uint32_t>(zeros - n));
    put(static_cast<std::uint32_t>(end - zeros));
    for (n = zeros; n < end; ++n) {
      const std::int32_t delta = values[n] - previous;
      previous = values[n];
      put((static_cast<std::uint32_t>(delta) << 1) ^ static_cast<std::uint32_t>(delta >> 31));
    }
  }
  while (groups.size() % 8 != 0) groups.push_back(0);
  for (std::size_t n = 0; n < groups.size(); n += 8) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 8; ++k) word |= groups[n + k] << (28 - 4 * k);
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&word);
    message.data.insert(message.data.end(), bytes, bytes + 4);
  }
  return message;
}

}  // namespace ttsdf::test
