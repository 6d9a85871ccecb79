// Writes good inputs of every target, from which the fuzzers start: make_corpus FOLDER.

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "../map/room_map.h"
#include "../ros/depth_samples.h"
#include "input.h"
#include "ros/common/cloud_conversion.h"
#include "ttsdf_localization/map/map_io.h"

namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

void write(const fs::path& path, const Bytes& bytes) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

void writeMaps(const fs::path& folder) {
  for (const auto encoding :
       {ttsdf::Encoding::kFloat32, ttsdf::Encoding::kFloat16, ttsdf::Encoding::kQuantized}) {
    ttsdf::EncodeOptions options;
    options.encoding = encoding;
    const Bytes bytes = ttsdf::serialize(ttsdf::test::roomMap(ttsdf::Dims(14, 11, 12), 4), options);
    for (const char* target : {"map_reader", "map_message"})
      write(folder / target / ttsdf::name(encoding), bytes);
  }
}

void writeClouds(const fs::path& folder) {
  sensor_msgs::PointCloud2 cloud = ttsdf::toCloudMessage(ttsdf::ScanPoints::Random(3, 60), {});
  write(folder / "point_cloud" / "plain", ttsdf::fuzz::bytesOf(cloud));
  cloud.height = 6;
  cloud.width = 10;
  cloud.row_step = 120;
  write(folder / "point_cloud" / "organised", ttsdf::fuzz::bytesOf(cloud));
  cloud.is_bigendian = 1;
  cloud.row_step = 0;
  write(folder / "point_cloud" / "odd", ttsdf::fuzz::bytesOf(cloud));
}

void writeDepth(const fs::path& folder) {
  using namespace ttsdf::test;
  for (const bool millimetres : {false, true}) {
    const sensor_msgs::Image image = depthImage(0, 0, kDepthWidth, kDepthHeight, 1, millimetres);
    ttsdf::fuzz::Output out;
    out.number(std::uint8_t{0});
    ttsdf::fuzz::write(depthInfo(), out);
    out.number(image.width).number(image.height).number(image.step);
    out.number(static_cast<std::uint8_t>(millimetres ? 0 : 1)).number(image.is_bigendian);
    write(folder / "depth_image" / image.encoding, out.with(image.data));
  }
  for (const bool rvl : {false, true}) {
    ttsdf::fuzz::Output out;
    out.number(std::uint8_t{1});
    ttsdf::fuzz::write(depthInfo(), out);
    out.number(static_cast<std::uint8_t>(rvl ? 2 : 0));
    const auto message = rvl ? compressedRvl(depthMillimetres()) : compressedPng(depthMillimetres(), "16UC1");
    write(folder / "depth_image" / (rvl ? "rvl" : "png"), out.with(message.data));
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: make_corpus FOLDER\n";
    return 2;
  }
  const fs::path folder = argv[1];
  writeMaps(folder);
  writeClouds(folder);
  writeDepth(folder);
  return 0;
}
