#pragma once
// The only place that knows where a sample sits: sample (i, j, k) lies at voxel_size * (i, j, k) in the grid
// frame, and T_map_grid puts the grid frame into the map frame (it may turn the grid so that walls follow the
// axes).

#include <Eigen/Geometry>

#include "ttsdf_localization/tensor/dense_tensor.h"

namespace ttsdf {

struct GridGeometry {
  Dims dims = Dims::Zero();
  double voxel_size = 0.0;                                       ///< [m]
  Eigen::Isometry3d T_map_grid = Eigen::Isometry3d::Identity();  ///< grid frame (metres) -> map frame
  /// Map frame [m]: what T_map_grid and every point below are relative to. Zero for maps near zero. Fields of
  /// maps far away (UTM) have whole metres here, so that points in single precision will do.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();

  Eigen::Vector3d samplePosition(const Eigen::Vector3d& index) const {
    return T_map_grid * (voxel_size * index);
  }
  /// Continuous index of a point of the map frame.
  Eigen::Vector3d toIndex(const Eigen::Vector3d& p_map) const {
    return (T_map_grid.inverse() * p_map) / voxel_size;
  }
  /// True where trilinear interpolation has all its samples: 0 <= index <= dims - 1.
  bool containsIndex(const Eigen::Vector3d& index) const {
    return (index.array() >= 0.0).all() && (index.array() <= (dims - 1).cast<double>()).all();
  }
  std::size_t voxelCount() const {
    return static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
           static_cast<std::size_t>(dims[2]);
  }
};

/// The same grid relative to an origin near it; itself if it lies near zero.
GridGeometry relativeToOrigin(GridGeometry geometry);
/// A pose of the map frame relative to the geometry's origin, and back.
inline Eigen::Isometry3d relativeTo(const GridGeometry& geometry, Eigen::Isometry3d T_map_sensor) {
  T_map_sensor.translation() -= geometry.origin;
  return T_map_sensor;
}
inline Eigen::Isometry3d inMapFrame(const GridGeometry& geometry, Eigen::Isometry3d T_origin_sensor) {
  T_origin_sensor.translation() += geometry.origin;
  return T_origin_sensor;
}

/// Throws std::invalid_argument: extents >= 1, voxel size positive and finite, T_map_grid a rigid motion.
void check(const GridGeometry& geometry);

}  // namespace ttsdf
