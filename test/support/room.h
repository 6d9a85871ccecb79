#pragma once
// An analytic room for tests: exact signed distance (positive in free space) and exact scans of it.
// 6 x 5 x 3 m, origin in a corner of the floor, z up; two boxes and a ball make every place different.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "ttsdf_localization/field/dense_distance_field.h"
#include "ttsdf_localization/registration/registration.h"

namespace ttsdf::test {

inline double boxDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& centre,
                          const Eigen::Vector3d& half) {
  const Eigen::Vector3d q = (p - centre).cwiseAbs() - half;
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
}

struct Room {
  Eigen::Vector3d size{6.0, 5.0, 3.0};

  double distance(const Eigen::Vector3d& p) const {
    const double walls = std::min(p.minCoeff(), (size - p).minCoeff());
    const double cupboard = boxDistance(p, {0.4, 3.2, 1.0}, {0.4, 0.9, 1.0});
    const double table = boxDistance(p, {4.2, 1.2, 0.4}, {0.8, 0.5, 0.4});
    const double ball = (p - Eigen::Vector3d(4.6, 4.2, 1.4)).norm() - 0.45;
    return std::min({walls, cupboard, table, ball});
  }
};

/// The room sampled with a border of 0.3 m; values clamped to [-0.3, 0.6] m.
template <class Scene>
DenseTensor sampleScene(const Scene& scene, double voxel_size, GridGeometry& geometry) {
  const double border = 0.3;
  geometry.voxel_size = voxel_size;
  geometry.dims = ((scene.size.array() + 2.0 * border) / voxel_size).ceil().template cast<int>() + 1;
  geometry.T_map_grid.translation().setConstant(-border);
  DenseTensor tensor(geometry.dims);
  for (int k = 0; k < geometry.dims[2]; ++k) {
    for (int j = 0; j < geometry.dims[1]; ++j) {
      for (int i = 0; i < geometry.dims[0]; ++i) {
        const double d = scene.distance(geometry.samplePosition(Eigen::Vector3i(i, j, k).cast<double>()));
        tensor(i, j, k) = static_cast<float>(std::clamp(d, -0.3, 0.6));
      }
    }
  }
  return tensor;
}

/// A camera (z forward, x right, y down) at `position`, its optical axis in the horizontal direction `yaw`,
/// tilted down by `tilt` [rad].
inline Eigen::Isometry3d cameraPose(const Eigen::Vector3d& position, double yaw, double tilt = 0.0) {
  Eigen::Matrix3d R_level;  // camera axes in a frame that looks along x with z up
  R_level << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() =
      (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitY()))
          .toRotationMatrix() *
      R_level;
  T.translation() = position;
  return T;
}

/// Points of a pinhole camera of 60 x 47 degrees in the camera frame, by sphere tracing; row-major, no holes.
template <class Scene>
ScanPoints renderScan(const Scene& scene, const Eigen::Isometry3d& T_map_camera, int width = 64,
                      int height = 48, double noise_sigma = 0.0, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  ScanPoints points(3, width * height);
  const double focal = 0.866 * width;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const Eigen::Vector3d ray =
          Eigen::Vector3d((u - 0.5 * (width - 1)) / focal, (v - 0.5 * (height - 1)) / focal, 1.0)
              .normalized();
      const Eigen::Vector3d direction = T_map_camera.linear() * ray;
      double range = 0.0;
      for (int step = 0; step < 200; ++step) {
        const double d = scene.distance(T_map_camera.translation() + range * direction);
        range += d;
        if (d < 1e-6 || range > 50.0) break;
      }
      points.col(v * width + u) = ((range + noise_sigma * noise(random)) * ray).cast<float>();
    }
  }
  return points;
}

}  // namespace ttsdf::test
