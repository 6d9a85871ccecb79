#pragma once
// Slow and plain evaluation of a sampled field in double, written from the definition: the oracle of the
// field tests.

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "../tensor/test_tensors.h"
#include "ttsdf_localization/field/distance_field.h"

namespace ttsdf::test {

struct OracleSample {
  double value = 0.0;
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();  // map frame
};

/// Trilinear interpolation between the eight samples around a point inside the box.
inline OracleSample trilinear(const DenseTensor& tensor, const GridGeometry& geometry,
                              const Eigen::Vector3d& p_map) {
  const Eigen::Matrix3d R = geometry.T_map_grid.linear();
  const Eigen::Vector3d index =
      R.transpose() * (p_map - geometry.T_map_grid.translation()) / geometry.voxel_size;
  Eigen::Array3i base;
  Eigen::Vector3d f;
  for (int axis = 0; axis < 3; ++axis) {
    base[axis] =
        std::clamp(static_cast<int>(std::floor(index[axis])), 0, std::max(0, geometry.dims[axis] - 2));
    f[axis] = index[axis] - base[axis];
  }
  OracleSample sample;
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Array3i d(corner & 1, (corner >> 1) & 1, corner >> 2);
    const Eigen::Array3i at = (base + d).min(geometry.dims - 1);
    const double value = tensor(at[0], at[1], at[2]);
    Eigen::Vector3d w;
    for (int axis = 0; axis < 3; ++axis) w[axis] = d[axis] ? f[axis] : 1.0 - f[axis];
    sample.value += w.prod() * value;
    for (int axis = 0; axis < 3; ++axis) {
      slope[axis] += (d[axis] ? 1.0 : -1.0) * w[(axis + 1) % 3] * w[(axis + 2) % 3] * value;
    }
  }
  sample.gradient = R * slope / geometry.voxel_size;
  return sample;
}

/// The paper's rounding to the nearest voxel.
inline Eigen::Array3i nearestVoxel(const GridGeometry& geometry, const Eigen::Vector3d& p_map) {
  const Eigen::Vector3d index = geometry.T_map_grid.linear().transpose() *
                                (p_map - geometry.T_map_grid.translation()) / geometry.voxel_size;
  return (index.array() + 0.5).floor().cast<int>();
}

/// A grid that is turned, shifted and not centred anywhere.
inline GridGeometry turnedGeometry(const Dims& dims, double voxel_size = 0.02) {
  GridGeometry geometry;
  geometry.dims = dims;
  geometry.voxel_size = voxel_size;
  geometry.T_map_grid = Eigen::Translation3d(-1.3, 2.1, 0.4) *
                        Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, -2.0, 3.0).normalized());
  return geometry;
}

/// Points of the map frame at continuous indices inside the box that keep `margin` voxels from the planes
/// between cells (plane = 0: at the samples, 0.5: half-way, where the nearest voxel changes).
inline Eigen::Matrix3Xf randomPoints(const GridGeometry& geometry, int count, double plane = 0.0,
                                     double margin = 0.0, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform;
  Eigen::Matrix3Xf points(3, count);
  for (int n = 0; n < count; ++n) {
    Eigen::Vector3d index;
    for (int axis = 0; axis < 3; ++axis) {
      do {
        index[axis] = uniform(random) * (geometry.dims[axis] - 1);
      } while (geometry.dims[axis] > 1 &&
               std::abs(index[axis] - plane - std::round(index[axis] - plane)) < margin);
    }
    points.col(n) = geometry.samplePosition(index).cast<float>();
  }
  return points;
}

}  // namespace ttsdf::test
