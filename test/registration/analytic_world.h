#pragma once
// Worlds with an exact signed distance, scans of them by ray casting, and fields made from them.

#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <random>

#include "../tensor/test_tensors.h"
#include "ttsdf_localization/field/dense_distance_field.h"
#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf::test {

using Sdf = std::function<double(const Eigen::Vector3d&)>;

/// Positive outside.
inline double boxSdf(const Eigen::Vector3d& p, const Eigen::Vector3d& centre, const Eigen::Vector3d& half) {
  const Eigen::Vector3d d = (p - centre).cwiseAbs() - half;
  return d.cwiseMax(0.0).norm() + std::min(d.maxCoeff(), 0.0);
}

/// A room of 4 x 3 x 2.4 m with its corner at the origin, with furniture that leaves no symmetry.
inline double furnishedRoom(const Eigen::Vector3d& p) {
  const double walls = std::min(p.minCoeff(), (Eigen::Vector3d(4.0, 3.0, 2.4) - p).minCoeff());
  return std::min({walls, boxSdf(p, {0.6, 0.4, 0.4}, {0.6, 0.4, 0.4}),
                   boxSdf(p, {3.7, 2.0, 0.9}, {0.3, 0.5, 0.9}), boxSdf(p, {1.8, 2.75, 0.5}, {0.5, 0.25, 0.5}),
                   (p - Eigen::Vector3d(2.2, 1.4, 0.2)).norm() - 0.35});
}

/// The same room empty: half a turn about the vertical through its middle changes nothing.
inline double emptyRoom(const Eigen::Vector3d& p) {
  return std::min(p.minCoeff(), (Eigen::Vector3d(4.0, 3.0, 2.4) - p).minCoeff());
}

inline GridGeometry roomGeometry(double voxel_size = 0.05) {
  GridGeometry geometry;
  geometry.voxel_size = voxel_size;
  geometry.dims = ((Eigen::Array3d(4.0, 3.0, 2.4) + 0.6) / voxel_size + 1.5).cast<int>();
  geometry.T_map_grid.translation().setConstant(-0.3);
  return geometry;
}

inline DenseTensor sampled(const Sdf& sdf, const GridGeometry& geometry) {
  return tabulate(geometry.dims, [&](int i, int j, int k) {
    return sdf(geometry.samplePosition(Eigen::Vector3d(i, j, k)));
  });
}

inline std::shared_ptr<const DistanceField> denseField(const Sdf& sdf, const GridGeometry& geometry,
                                                       SupportMask mask = {}) {
  return std::make_shared<DenseDistanceField>(sampled(sdf, geometry), geometry, std::move(mask));
}

/// Directions evenly over the sphere.
inline std::vector<Eigen::Vector3d> directions(int count) {
  std::vector<Eigen::Vector3d> result;
  for (int n = 0; n < count; ++n) {
    const double z = 1.0 - (2.0 * n + 1.0) / count, angle = n * M_PI * (3.0 - std::sqrt(5.0));
    result.emplace_back(std::sqrt(1.0 - z * z) * std::cos(angle), std::sqrt(1.0 - z * z) * std::sin(angle),
                        z);
  }
  return result;
}

/// Directions of a depth camera: 60 x 45 degrees about z.
inline std::vector<Eigen::Vector3d> cameraDirections(int columns, int rows) {
  std::vector<Eigen::Vector3d> result;
  for (int v = 0; v < rows; ++v) {
    for (int u = 0; u < columns; ++u) {
      const double x = (2.0 * u + 1.0) / columns - 1.0, y = (2.0 * v + 1.0) / rows - 1.0;
      result.push_back(Eigen::Vector3d(std::tan(M_PI / 6.0) * x, std::tan(M_PI / 8.0) * y, 1.0).normalized());
    }
  }
  return result;
}

/// First surface points along the rays, sensor frame, with normal noise along the ray. Sphere tracing: exact
/// to 1e-7 m.
inline Eigen::Matrix3Xf castRays(const Sdf& sdf, const Eigen::Isometry3d& T_map_sensor,
                                 const std::vector<Eigen::Vector3d>& rays, double noise = 0.0,
                                 unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<Eigen::Vector3f> hits;
  for (const auto& ray : rays) {
    double range = 0.0, distance = 1.0;
    for (int step = 0; step < 400 && distance > 1e-7 && range < 30.0; ++step) {
      distance = sdf(T_map_sensor * (range * ray));
      range += distance;
    }
    if (distance < 1e-6) hits.push_back(((range + noise * normal(random)) * ray).cast<float>());
  }
  Eigen::Matrix3Xf points(3, static_cast<Eigen::Index>(hits.size()));
  for (std::size_t n = 0; n < hits.size(); ++n) points.col(static_cast<Eigen::Index>(n)) = hits[n];
  return points;
}

/// Turns and moves a pose by given amounts in random directions, about the sensor's position.
inline Eigen::Isometry3d perturbed(const Eigen::Isometry3d& T, double metres, double radians, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto direction = [&] {
    return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
  };
  Eigen::Isometry3d result = T;
  result.linear() = expSo3(radians * direction()) * T.linear();
  result.translation() += metres * direction();
  return result;
}

/// A pose inside the furnished room, in its free space.
inline Eigen::Isometry3d roomPose(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  do {
    T.translation() = Eigen::Vector3d(4.0 * uniform(random), 3.0 * uniform(random), 2.4 * uniform(random));
  } while (furnishedRoom(T.translation()) < 0.4);
  T.linear() = expSo3(Eigen::Vector3d(uniform(random) - 0.5, uniform(random) - 0.5, 6.0 * uniform(random)));
  return T;
}

}  // namespace ttsdf::test
