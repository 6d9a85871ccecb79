#include "ttsdf_localization/evaluation/scan_set.h"

#include <pcl/filters/voxel_grid.h>
#include <pcl/point_types.h>

#include <filesystem>
#include <stdexcept>

namespace ttsdf {

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

std::string selectionText(const FrameSelection& selection) {
  return "index % " + std::to_string(selection.every) + " == " + std::to_string(selection.offset);
}

Cloud::Ptr filtered(const Cloud::ConstPtr& cloud, double cell_size) {
  pcl::VoxelGrid<pcl::PointXYZ> filter;
  const auto leaf = static_cast<float>(cell_size);
  filter.setLeafSize(leaf, leaf, leaf);
  filter.setInputCloud(cloud);
  auto result = std::make_shared<Cloud>();
  filter.filter(*result);
  return result;
}

}  // namespace

ScanSet scansFromFrames(const FrameFolder& folder, const FrameSelection& selection) {
  ScanSet set;
  for (const auto& frame : folder.select(selection.every, selection.offset)) {
    try {
      EvaluationScan scan;
      scan.name = std::filesystem::path(frame.depth_path).filename().string();
      scan.index = frame.index;
      scan.T_map_sensor = folder.pose(frame);
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

Eigen::Matrix3Xf mapCloudFromFrames(const FrameFolder& folder, const FrameSelection& selection,
                                    double cell_size) {
  auto cloud = std::make_shared<Cloud>();
  for (auto& scan : scansFromFrames(folder, selection).scans) {
    const Eigen::Isometry3f T_map_sensor = scan.T_map_sensor.cast<float>();
    const Eigen::Matrix3Xf points = (T_map_sensor * scan.points.colwise().homogeneous()).topRows<3>();
    for (Eigen::Index n = 0; n < points.cols(); ++n) {
      cloud->push_back(pcl::PointXYZ(points(0, n), points(1, n), points(2, n)));
    }
    scan.points.resize(3, 0);
  }
  const auto cells = filtered(cloud, cell_size);
  Eigen::Matrix3Xf result(3, static_cast<Eigen::Index>(cells->size()));
  for (Eigen::Index n = 0; n < result.cols(); ++n) {
    result.col(n) = (*cells)[static_cast<std::size_t>(n)].getVector3fMap();
  }
  return result;
}

}  // namespace ttsdf
