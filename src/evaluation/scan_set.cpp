#include "ttsdf_localization/evaluation/scan_set.h"

#include <pcl/filters/voxel_grid.h>
#include <pcl/point_types.h>

#include <cmath>
#include <filesystem>
#include <stdexcept>

namespace ttsdf {

namespace {

using Cloud = pcl::PointCloud<pcl::PointNormal>;  // normal: towards the sensor

std::string selectionText(const FrameSelection& selection) {
  return "index % " + std::to_string(selection.every) + " == " + std::to_string(selection.offset);
}

void append(Cloud& cloud, const Eigen::Vector3f& point, const Eigen::Vector3f& towards_sensor) {
  pcl::PointNormal entry;
  entry.getVector3fMap() = point;
  entry.getNormalVector3fMap() = towards_sensor;
  cloud.push_back(entry);
}

// One point per cell, positions and directions averaged.
MapCloud filtered(const Cloud::ConstPtr& cloud, double cell_size) {
  pcl::VoxelGrid<pcl::PointNormal> filter;
  const auto leaf = static_cast<float>(cell_size);
  filter.setLeafSize(leaf, leaf, leaf);
  filter.setInputCloud(cloud);
  Cloud cells;
  filter.filter(cells);
  MapCloud result;
  result.points.resize(3, static_cast<Eigen::Index>(cells.size()));
  result.towards_sensor.resizeLike(result.points);
  for (Eigen::Index n = 0; n < result.points.cols(); ++n) {
    const auto& cell = cells[static_cast<std::size_t>(n)];
    result.points.col(n) = cell.getVector3fMap();
    result.towards_sensor.col(n) = cell.getNormalVector3fMap().normalized();
  }
  return result;
}

// A point of a triangle for two numbers in [0, 1): uniform over its area (Turk's folding of the square).
Eigen::Vector3f pointOf(const Eigen::Matrix3f& corners, float s, float t) {
  if (s + t > 1.0f) {
    s = 1.0f - s;
    t = 1.0f - t;
  }
  return corners.col(0) + s * (corners.col(1) - corners.col(0)) + t * (corners.col(2) - corners.col(0));
}

Eigen::Isometry3d truth(const FrameFolder& folder, const FrameEntry& frame) {
  std::string path = frame.depth_path;
  const auto ending = path.rfind(".depth.");
  if (ending == std::string::npos) return folder.pose(frame);
  path.replace(ending, std::string::npos, ".truth.txt");
  return std::filesystem::exists(path) ? readPose(path) : folder.pose(frame);
}

}  // namespace

ScanSet scansFromFrames(const FrameFolder& folder, const FrameSelection& selection, PoseKind poses) {
  ScanSet set;
  for (const auto& frame : folder.select(selection.every, selection.offset)) {
    try {
      EvaluationScan scan;
      scan.name = std::filesystem::path(frame.depth_path).filename().string();
      scan.index = frame.index;
      scan.T_map_sensor = poses == PoseKind::kTruth ? truth(folder, frame) : folder.pose(frame);
      scan.points = toPoints(folder.depth(frame), folder.intrinsics(), selection.stride, selection.min_depth,
                             selection.max_depth);
      set.scans.push_back(std::move(scan));
    } catch (const std::runtime_error& error) {
      set.skipped.emplace_back(error.what());
    }
  }
  if (set.scans.empty()) {
    throw std::runtime_error("scans: got no readable frame with " + selectionText(selection) + " (" +
                             std::to_string(set.skipped.size()) + " unreadable), wanted at least one");
  }
  return set;
}

MapCloud mapCloudFromFrames(const FrameFolder& folder, const FrameSelection& selection, double cell_size) {
  Cloud::Ptr cloud(new Cloud);
  for (auto& scan : scansFromFrames(folder, selection, PoseKind::kRecorded).scans) {
    const Eigen::Isometry3f T_map_sensor = scan.T_map_sensor.cast<float>();
    for (Eigen::Index n = 0; n < scan.points.cols(); ++n) {
      append(*cloud, T_map_sensor * scan.points.col(n),
             T_map_sensor.linear() * -scan.points.col(n).normalized());
    }
    scan.points.resize(3, 0);
  }
  return filtered(cloud, cell_size);
}

MapCloud mapCloudFromMesh(const SurfaceMesh& mesh, double cell_size) {
  check(mesh);
  if (mesh.empty()) throw std::invalid_argument("map cloud: got a mesh without triangles, wanted a surface");
  constexpr double kSamplesPerCell = 16.0;
  constexpr float kPlastic1 = 0.7548777f, kPlastic2 = 0.5698403f;  // Roberts's R2 sequence: even coverage
  Cloud::Ptr cloud(new Cloud);
  double owed = 0.0;  // samples due: triangles smaller than one sample's area share them
  float s = 0.5f, t = 0.5f;
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
    Eigen::Matrix3f corners;
    for (int k = 0; k < 3; ++k) corners.col(k) = mesh.vertices.col(mesh.triangles(k, n));
    const Eigen::Vector3f normal = (corners.col(1) - corners.col(0)).cross(corners.col(2) - corners.col(0));
    owed += kSamplesPerCell * 0.5 * static_cast<double>(normal.norm()) / (cell_size * cell_size);
    for (; owed >= 1.0; owed -= 1.0) {
      s = std::fmod(s + kPlastic1, 1.0f);
      t = std::fmod(t + kPlastic2, 1.0f);
      append(*cloud, pointOf(corners, s, t), normal.normalized());
    }
  }
  return filtered(cloud, cell_size);
}

Eigen::Matrix3Xf thinned(const Eigen::Matrix3Xf& points, double cell_size) {
  Cloud::Ptr cloud(new Cloud);
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    if (points.col(n).allFinite()) append(*cloud, points.col(n), Eigen::Vector3f::UnitZ());
  }
  return filtered(cloud, cell_size).points;
}

}  // namespace ttsdf
