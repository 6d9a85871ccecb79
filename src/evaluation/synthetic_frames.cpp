#include "ttsdf_localization/evaluation/synthetic_frames.h"

#include <pcl/io/png_io.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <stdexcept>

#include "ttsdf_localization/frames/frame_folder.h"

namespace ttsdf {

FrameWriter::FrameWriter(std::string folder, const CameraIntrinsics& K, double units_per_metre)
    : folder_(std::move(folder)), units_per_metre_(units_per_metre) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  std::ofstream out(folder_ + "/camera-intrinsics.txt");
  out << std::setprecision(12) << K.fx << " 0 " << K.cx << "\n0 " << K.fy << ' ' << K.cy << "\n0 0 1\n";
  if (!out.flush()) throw std::runtime_error("frames folder '" + folder_ + "': cannot write into it");
}

void FrameWriter::write(int index, const DepthImage& image, const Eigen::Isometry3d& T_map_camera) const {
  constexpr double kLargest = 65534.0;  // 65535 is "no reading" too
  std::vector<unsigned short> units(image.depth.size(), 0);
  for (std::size_t n = 0; n < units.size(); ++n) {
    const double value = std::round(units_per_metre_ * static_cast<double>(image.depth[n]));
    if (value > 0.0 && value <= kLargest) units[n] = static_cast<unsigned short>(value);
  }
  const std::string depth_path = stem(index) + ".depth.png";
  pcl::io::saveShortPNGFile(depth_path, units.data(), image.width, image.height, 1);
  if (!std::filesystem::exists(depth_path)) throw std::runtime_error("'" + depth_path + "': cannot write");
  writePose(stem(index) + ".pose.txt", T_map_camera);
}

void FrameWriter::writeTruth(int index, const Eigen::Isometry3d& T_map_camera) const {
  writePose(stem(index) + ".truth.txt", T_map_camera);
}

std::string FrameWriter::stem(int index) const {
  char name[32];
  std::snprintf(name, sizeof name, "/frame-%06d", index);
  return folder_ + name;
}

SurfaceMesh scaledTo(const SurfaceMesh& mesh, double size) {
  check(mesh);
  if (mesh.vertices.cols() == 0) throw std::invalid_argument("mesh: got no vertices, wanted a surface");
  const Eigen::Vector3f low = mesh.vertices.rowwise().minCoeff(), high = mesh.vertices.rowwise().maxCoeff();
  const float extent = (high - low).maxCoeff();
  if (!(extent > 0.0f)) throw std::invalid_argument("mesh: got one without extent, wanted a surface");
  SurfaceMesh result = mesh;
  result.vertices = (mesh.vertices.colwise() - 0.5f * (low + high)) * (static_cast<float>(size) / extent);
  return result;
}

std::vector<Eigen::Isometry3d> viewsAround(double radius, int count, const CameraIntrinsics& K) {
  if (!(radius > 0.0) || count < 1) {
    throw std::invalid_argument("views: got radius " + std::to_string(radius) + " m and " +
                                std::to_string(count) + " views, wanted both above 0");
  }
  const double half_view =
      std::atan(std::min(0.5 * K.width / std::abs(K.fx), 0.5 * K.height / std::abs(K.fy)));
  const double distance = radius / std::sin(half_view);
  const double golden_angle = 3.14159265358979323846 * (3.0 - std::sqrt(5.0));
  std::vector<Eigen::Isometry3d> views;
  for (int n = 0; n < count; ++n) {
    const double height = 1.0 - 2.0 * (n + 0.5) / count, azimuth = golden_angle * n;
    const double flat = std::sqrt(1.0 - height * height);
    const Eigen::Vector3d outward(flat * std::cos(azimuth), flat * std::sin(azimuth), height);
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    const Eigen::Vector3d forward = -outward;
    const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    T.linear() << right, forward.cross(right), forward;
    T.translation() = distance * outward;
    views.push_back(T);
  }
  return views;
}

}  // namespace ttsdf
