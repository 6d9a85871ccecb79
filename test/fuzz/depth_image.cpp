// sensor_msgs/CameraInfo with an Image or a CompressedImage: the first byte says which.

#include <stdexcept>

#include "input.h"
#include "ros/messages/depth_conversion.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ttsdf::fuzz;
  Input in(data, size);
  const auto kind = in.number<std::uint8_t>();
  const sensor_msgs::CameraInfo info = readInfo(in);
  try {
    sensor_msgs::Image image;
    if (kind % 2 == 0) {
      image = readImage(in);
    } else {
      sensor_msgs::CompressedImage compressed;
      compressed.format = chosen(kFormats, in.number<std::uint8_t>());
      compressed.data = in.rest();
      image = ttsdf::decompressDepth(compressed);
    }
    if (!ttsdf::convertDepth(image, info, {}).points.allFinite()) __builtin_trap();
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
