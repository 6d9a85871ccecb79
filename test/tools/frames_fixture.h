#pragma once
// A folder of rendered depth frames in the 7-Scenes layout.

#include <pcl/io/png_io.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "ttsdf_localization/frames/frame_folder.h"
#include "ttsdf_localization/simulation/depth_camera.h"
#include "ttsdf_localization/simulation/worlds.h"

namespace ttsdf {

/// `count` frames of a camera that turns about itself in the middle of a room, from one heading to another
/// [rad].
inline void writeFramesOf(const AnalyticScene& scene, const std::string& folder, int count, double from,
                          double to) {
  std::filesystem::create_directories(folder);
  DepthCameraOptions options;
  options.width = 160;
  options.height = 120;
  options.fx = options.fy = 70.0;  // wide: every view holds walls, floor and a corner
  const DepthCamera camera(options);
  const auto& K = camera.intrinsics();
  std::ofstream(folder + "/camera-intrinsics.txt")
      << K.fx << " 0 " << K.cx << "\n0 " << K.fy << ' ' << K.cy << "\n0 0 1\n";
  Eigen::Matrix3d R_body_optical;  // z forward, x right, y down -> x forward, y left, z up
  R_body_optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  for (int n = 0; n < count; ++n) {
    const double yaw = from + (to - from) * n / count;
    Eigen::Isometry3d T_map_camera = Eigen::Isometry3d::Identity();
    T_map_camera.translation() << 2.0 + 0.2 * std::cos(yaw), 1.5, 1.3;
    T_map_camera.linear() =
        Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix() * R_body_optical;
    const DepthImage image = camera.render(scene, T_map_camera);
    std::vector<unsigned short> millimetres(image.depth.size());
    for (std::size_t p = 0; p < millimetres.size(); ++p) {
      const float depth = image.depth[p];
      millimetres[p] = depth > 0.0f ? static_cast<unsigned short>(std::lround(1000.0f * depth)) : 0;
    }
    char name[32];
    std::snprintf(name, sizeof name, "/frame-%06d", n);
    pcl::io::saveShortPNGFile(folder + name + ".depth.png", millimetres.data(), image.width, image.height, 1);
    writePose(folder + name + ".pose.txt", T_map_camera);
  }
}

/// All round the simulated room.
inline void writeFrames(const std::string& folder, int count) {
  writeFramesOf(makeRoom(), folder, count, 0.0, 2.0 * 3.14159265358979);
}

}  // namespace ttsdf
