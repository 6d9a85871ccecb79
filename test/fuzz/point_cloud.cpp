// sensor_msgs/PointCloud2.

#include <stdexcept>

#include "input.h"
#include "ros/messages/cloud_conversion.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ttsdf::fuzz::Input in(data, size);
  const sensor_msgs::PointCloud2 cloud = ttsdf::fuzz::readCloud(in);
  try {
    if (!ttsdf::convertCloud(cloud, {}).points.allFinite()) __builtin_trap();
    ttsdf::allPoints(cloud);
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
