// Writes good inputs of every target, from which the fuzzers start: make_corpus FOLDER.

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "../map/first_form.h"
#include "../map/room_map.h"
#include "../ros/messages/depth_samples.h"
#include "files.h"
#include "ros/messages/cloud_conversion.h"
#include "ttsdf_localization/map/map_io.h"

namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

void write(const fs::path& path, const Bytes& bytes) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

/// As small as holds everything: what is read a million times is to be read fast.
void writeMaps(const fs::path& folder) {
  for (const auto encoding :
       {ttsdf::Encoding::kFloat32, ttsdf::Encoding::kFloat16, ttsdf::Encoding::kQuantized}) {
    ttsdf::EncodeOptions options;
    options.encoding = encoding;
    const Bytes bytes = ttsdf::serialize(ttsdf::test::roomMap(ttsdf::Dims(8, 7, 6), 3), options);
    for (const char* target : {"map_reader", "map_message"})
      write(folder / target / ttsdf::name(encoding), bytes);
  }
  for (const char* target : {"map_reader", "map_message"})
    write(folder / target / "first_form", ttsdf::test::kFirstForm);
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

/// A file after the byte that chooses what it is.
Bytes chosenText(std::uint8_t choice, const std::string& text) {
  Bytes bytes{choice};
  bytes.insert(bytes.end(), text.begin(), text.end());
  return bytes;
}

void writeScanFiles(const fs::path& folder) {
  const std::string pcd =
      "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n";
  const std::string view = "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\n";
  write(folder / "cloud_file" / "pcd", chosenText(0, pcd + view + "DATA ascii\n1 2 3\n4 5 6.5\n"));
  write(folder / "cloud_file" / "pcd_binary",
        chosenText(0, pcd + view + "DATA binary\n" + std::string(24, 'A')));
  write(folder / "cloud_file" / "pcd_packed",
        chosenText(0, pcd + view + "DATA binary_compressed\n" + std::string({10, 0, 0, 0, 24, 0, 0, 0}) +
                          std::string({0, 'A', '\xe0', 14, 0, 0, 'A', 0, 'A'})));
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  write(folder / "cloud_file" / "ply", chosenText(1, ply + "end_header\n0 0 0\n1 0 0\n0 1 0\n"));
  write(folder / "cloud_file" / "xyz", chosenText(2, "# x y z\n1 2 3\n4.5 5 6e1\n"));
  write(folder / "cloud_file" / "csv", chosenText(3, "x,y,z,i\n1,2,3,4\n4,5,6,7\n"));
  write(folder / "cloud_file" / "bin", chosenText(4, std::string(48, '@')));
}

void writeMeshFiles(const fs::path& folder) {
  const std::string vertices = "0 0 0\n1 0 0\n0 1 0\n";
  const std::string ply =
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  write(folder / "mesh_file" / "ply",
        chosenText(0, "ply\nformat ascii 1.0\n" + ply + vertices + "3 0 1 2\n"));
  write(folder / "mesh_file" / "ply_binary",
        chosenText(0, "ply\nformat binary_little_endian 1.0\n" + ply + std::string(36, '@') +
                          std::string({3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0})));
  write(folder / "mesh_file" / "obj",
        chosenText(1, "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 -1//1\n"));
  write(folder / "mesh_file" / "off", chosenText(2, "OFF\n3 1 0\n" + vertices + "3 0 1 2\n"));
  write(folder / "mesh_file" / "stl",
        chosenText(3,
                   "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
                   "endloop\nendfacet\nendsolid a\n"));
  write(folder / "mesh_file" / "stl_binary",
        chosenText(3, std::string(80, ' ') + std::string({1, 0, 0, 0}) + std::string(50, '?')));
}

const std::string kPose = "1 0 0 0.5\n0 1 0 0\n0 0 1 2\n0 0 0 1\n";

void writeTextFiles(const fs::path& folder) {
  write(folder / "text_file" / "trajectory", chosenText(0, "# t\n1.5 0 0 0 0 0 0 1\n1.6 1 0 0 0 0 0 1\n"));
  write(folder / "text_file" / "options", chosenText(1, "a: 1\nb: {c: [1, 2.5], d: true}\n"));
  write(folder / "text_file" / "atlas",
        chosenText(2, "x_resolution: 10\ny_resolution: 10\na.ttsdf: [0, 0]\n"));
  write(folder / "text_file" / "own_atlas",
        chosenText(2, "frame_id: map\nmaps:\n  - {file: a.ttsdf, box: {min: [0, 0, 0], max: [1, 1, 1]}}\n"));
  write(folder / "text_file" / "batch", chosenText(3, "# s\na.pcd a.txt\n\"b c.pcd\" b.txt c.txt\n"));
  write(folder / "text_file" / "pose", chosenText(4, kPose));
}

void addFile(Bytes& bytes, const std::string& name, const std::string& text) {
  const auto& names = ttsdf::fuzz::kFrameFiles;
  bytes.push_back(static_cast<std::uint8_t>(std::find(names.begin(), names.end(), name) - names.begin()));
  bytes.push_back(static_cast<std::uint8_t>(text.size() & 0xFF));
  bytes.push_back(static_cast<std::uint8_t>(text.size() >> 8));
  bytes.insert(bytes.end(), text.begin(), text.end());
}

void writeFrameFolders(const fs::path& folder) {
  const auto message = ttsdf::test::compressedPng(ttsdf::test::depthMillimetres(), "16UC1");
  const std::string image(message.data.begin() + 12, message.data.end());  // behind the message's own header
  const std::string matrix = "525 0 319.5\n0 525 239.5\n0 0 1\n";
  Bytes seven_scenes, tum, scannet, replica;
  addFile(seven_scenes, "camera-intrinsics.txt", matrix);
  addFile(seven_scenes, "frame-000000.depth.png", image);
  addFile(seven_scenes, "frame-000000.pose.txt", kPose);
  write(folder / "frame_folder" / "seven_scenes", seven_scenes);
  addFile(tum, "depth.txt", "# d\n1.0 depth/1.png\n");
  addFile(tum, "groundtruth.txt", "0.9 0 0 0 0 0 0 1\n1.1 0 0 0 0 0 0 1\n");
  addFile(tum, "depth/1.png", image);
  write(folder / "frame_folder" / "tum", tum);
  addFile(scannet, "intrinsic/intrinsic_depth.txt", "577 0 319 0\n0 577 239 0\n0 0 1 0\n0 0 0 1\n");
  addFile(scannet, "depth/0.png", image);
  addFile(scannet, "pose/0.txt", kPose);
  write(folder / "frame_folder" / "scannet", scannet);
  addFile(replica, "traj.txt", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n");
  addFile(replica, "results/depth000000.png", image);
  addFile(replica, "cam_params.json",
          "{\"camera\": {\"w\": 64, \"h\": 48, \"fx\": 60, \"fy\": 60, \"cx\": 32, "
          "\"cy\": 24, \"scale\": 6553.5}}");
  write(folder / "frame_folder" / "replica", replica);
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
  writeScanFiles(folder);
  writeMeshFiles(folder);
  writeTextFiles(folder);
  writeFrameFolders(folder);
  return 0;
}
