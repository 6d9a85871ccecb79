#pragma once
// A small room with a ball in it, as a map of full rank, and scans of its surface.

#include <cmath>
#include <random>

#include "ttsdf_localization/compression/map_writer.h"
#include "ttsdf_localization/compression/tt_svd.h"
#include "ttsdf_localization/geometry/se3.h"
#include "ttsdf_localization/registration/registration.h"

namespace ttsdf {

/// Signed distance inside the box [0, 3] x [0, 2] x [0, 2.4] m with a ball of 0.4 m; positive in free space.
inline double roomDistance(const Eigen::Vector3d& p) {
  const Eigen::Array3d size(3.0, 2.0, 2.4);
  const double walls = std::min(p.array().minCoeff(), (size - p.array()).minCoeff());
  return std::min(walls, (p - Eigen::Vector3d(2.1, 0.7, 0.6)).norm() - 0.4);
}

inline TtSdfMap roomMap() {
  TtSdfMap map;
  map.geometry.dims = Dims(68, 48, 56);
  map.geometry.voxel_size = 0.05;
  map.geometry.T_map_grid.translation() << -0.2, -0.2, -0.2;
  map.truncation = 0.15;
  DenseTensor values(map.geometry.dims);
  for (int k = 0; k < values.dims()[2]; ++k) {
    for (int j = 0; j < values.dims()[1]; ++j) {
      for (int i = 0; i < values.dims()[0]; ++i) {
        values(i, j, k) =
            static_cast<float>(roomDistance(map.geometry.samplePosition(Eigen::Vector3d(i, j, k))));
      }
    }
  }
  map.train = ttSvd(values, {}).train;
  return map;
}

/// Where a sensor in the room stands.
inline Eigen::Isometry3d roomSensorPose() {
  Vector6d twist;
  twist << 0.3, -0.2, 0.9, 0.0, 0.0, 0.0;
  Eigen::Isometry3d T = expSe3(twist);
  T.translation() << 0.9, 1.1, 1.3;
  return T;
}

/// Points on the surface in the sensor frame, by sphere tracing of rays in all directions.
inline ScanPoints roomScan(const Eigen::Isometry3d& T_map_sensor, int count) {
  std::mt19937 random(5);
  const auto uniform = [&random] { return static_cast<double>(random()) / 4294967296.0 * 2.0 - 1.0; };
  ScanPoints points(3, count);
  for (int n = 0; n < count;) {
    const Eigen::Vector3d ray(uniform(), uniform(), uniform());
    if (ray.norm() < 0.1 || ray.norm() > 1.0) continue;
    Eigen::Vector3d p = T_map_sensor.translation();
    const Eigen::Vector3d step = T_map_sensor.linear() * ray.normalized();
    for (int s = 0; s < 300; ++s) p += roomDistance(p) * step;
    points.col(n++) = (T_map_sensor.inverse() * p).cast<float>();
  }
  return points;
}

}  // namespace ttsdf
