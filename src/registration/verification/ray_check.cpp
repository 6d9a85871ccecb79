#include "ray_check.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace ttsdf {

namespace {

constexpr double kStepVoxels = 1.5;
constexpr double kInsideVoxels = 1.5;     // deeper than this in matter is an obstacle
constexpr double kBeforeEndVoxels = 2.5;  // the surface itself, seen at a flat angle ...
constexpr double kBeforeEndSigmas = 3.0;  // ... and with the sensor's noise
constexpr float kMostSteps = 1000.0F;     // bounds the cost where voxels are tiny
constexpr double kFarError = 0.75;        // of the far field, in its spacings: interpolation of thin things

struct Ray {
  Eigen::Vector3f direction;
  float at, end, step;  // [m] from the sensor
};

std::vector<Ray> raysOf(const ScanBuffer& scan, const Eigen::Matrix3f& R, double voxel, int wanted) {
  const Eigen::Vector3f centroid = scan.centroid().cast<float>();
  const int stride = std::max(1, scan.size() / std::max(1, wanted));
  std::vector<Ray> rays;
  for (int n = 0; n < scan.size(); n += stride) {
    const Eigen::Vector3f end = centroid + Eigen::Vector3f(scan.x()[n], scan.y()[n], scan.z()[n]);
    const double before = std::max(kBeforeEndVoxels * voxel, kBeforeEndSigmas * scan.noise(n));
    const float range = end.norm() - static_cast<float>(before);
    const float step = std::max(static_cast<float>(kStepVoxels * voxel), range / kMostSteps);
    if (range >= step) rays.push_back({R * end.normalized(), step, range, step});
  }
  return rays;
}

struct Samples {
  std::vector<Eigen::Vector3f> points;  // map frame
  std::vector<std::size_t> rays;        // of each point
};

FieldSamples evaluateAt(const DistanceField& field, const std::vector<Eigen::Vector3f>& points) {
  return field.evaluate(
      Eigen::Map<const Eigen::Matrix3Xf>(points.front().data(), 3, static_cast<Eigen::Index>(points.size())));
}

/// Points along the rays, in matter or so near to it that the far field cannot tell. The rays go together, so
/// that the field is asked for many points at once, and leap over free space.
Samples march(std::vector<Ray> rays, const Eigen::Vector3f& origin, const DistanceField* far, float inside) {
  const float near = far ? static_cast<float>(kFarError * far->geometry().voxel_size) - inside : 0.0F;
  std::vector<std::size_t> going(rays.size());
  std::iota(going.begin(), going.end(), 0);
  std::vector<Eigen::Vector3f> points;
  Samples samples;
  while (!going.empty()) {
    points.clear();
    for (const std::size_t n : going) points.push_back(origin + rays[n].at * rays[n].direction);
    const FieldSamples distances = far ? evaluateAt(*far, points) : FieldSamples();
    for (std::size_t k = 0; k < going.size(); ++k) {
      Ray& ray = rays[going[k]];
      float free = 0.0F;
      if (far && distances.states[k] == PointState::kValid)
        free = distances.values[static_cast<Eigen::Index>(k)] - near;
      if (free <= 0.0F) {
        samples.points.push_back(points[k]);
        samples.rays.push_back(going[k]);
      }
      ray.at += std::max(ray.step, free);
    }
    const auto arrived = [&](std::size_t n) { return rays[n].at > rays[n].end; };
    going.erase(std::remove_if(going.begin(), going.end(), arrived), going.end());
  }
  return samples;
}

}  // namespace

double blockedShare(const DistanceField& field, const DistanceField* far, const ScanBuffer& scan,
                    const Eigen::Isometry3d& T_map_sensor, int rays) {
  const double voxel = field.geometry().voxel_size;
  const auto inside = static_cast<float>(kInsideVoxels * voxel);
  const Eigen::Isometry3f T = T_map_sensor.cast<float>();
  const std::vector<Ray> all = raysOf(scan, T.linear(), voxel, rays);
  const Samples samples = march(all, T.translation(), far, inside);
  if (samples.points.empty()) return 0.0;
  const FieldSamples values = evaluateAt(field, samples.points);
  std::vector<char> blocked(all.size(), 0);
  for (std::size_t n = 0; n < samples.points.size(); ++n) {
    if (values.states[n] == PointState::kValid && values.values[static_cast<Eigen::Index>(n)] < -inside)
      blocked[samples.rays[n]] = 1;
  }
  return static_cast<double>(std::count(blocked.begin(), blocked.end(), 1)) / static_cast<double>(all.size());
}

}  // namespace ttsdf
