#include "ray_check.h"

#include <algorithm>
#include <vector>

namespace ttsdf {

namespace {

constexpr double kStepVoxels = 1.5;
constexpr float kBeforeEnd = 0.05F;    // [m] the surface itself, seen at a flat angle, with noise
constexpr double kInsideVoxels = 1.5;  // deeper than this in matter is an obstacle
constexpr float kLongest = 20.0F;      // [m] bounds the cost ...
constexpr float kMostSteps = 1000.0F;  // ... and so does this, where voxels are tiny
constexpr float kNear = 0.16F;         // [m] the far field is good to about half of this

struct Samples {
  std::vector<Eigen::Vector3f> points;  // map frame
  std::vector<int> rays;                // of each point
};

/// Points along the rays; returns the number of rays.
int march(const ScanBuffer& scan, const Eigen::Isometry3f& T, float step, int wanted, Samples& samples) {
  const Eigen::Vector3f centroid = scan.centroid().cast<float>();
  const int stride = std::max(1, scan.size() / std::max(1, wanted));
  int count = 0;
  for (int n = 0; n < scan.size(); n += stride) {
    const Eigen::Vector3f end = centroid + Eigen::Vector3f(scan.x()[n], scan.y()[n], scan.z()[n]);
    const float range = std::min(end.norm(), kLongest) - kBeforeEnd;
    if (range < step) continue;
    const Eigen::Vector3f direction = T.linear() * end.normalized();
    const float pace = std::max(step, range / kMostSteps);
    for (float s = pace; s <= range; s += pace) {
      samples.points.push_back(T.translation() + s * direction);
      samples.rays.push_back(count);
    }
    ++count;
  }
  return count;
}

FieldSamples ask(const DistanceField& field, const Samples& samples) {
  return field.evaluate(Eigen::Map<const Eigen::Matrix3Xf>(samples.points.front().data(), 3,
                                                           static_cast<Eigen::Index>(samples.points.size())));
}

/// Keeps what may be near a surface.
Samples nearSurfaces(const DistanceField& far, const Samples& all) {
  const FieldSamples distances = ask(far, all);
  Samples near;
  for (std::size_t n = 0; n < all.points.size(); ++n) {
    const bool valid = distances.states[n] == PointState::kValid;
    if (valid && distances.values[static_cast<Eigen::Index>(n)] > kNear) continue;
    near.points.push_back(all.points[n]);
    near.rays.push_back(all.rays[n]);
  }
  return near;
}

}  // namespace

double blockedShare(const DistanceField& field, const DistanceField* far, const ScanBuffer& scan,
                    const Eigen::Isometry3d& T_map_sensor, int rays) {
  const double voxel = field.geometry().voxel_size;
  const auto inside = static_cast<float>(kInsideVoxels * voxel);
  Samples samples;
  const int count =
      march(scan, T_map_sensor.cast<float>(), static_cast<float>(kStepVoxels * voxel), rays, samples);
  if (far && !samples.points.empty()) samples = nearSurfaces(*far, samples);
  if (samples.points.empty()) return 0.0;
  const FieldSamples values = ask(field, samples);
  std::vector<char> blocked(static_cast<std::size_t>(count), 0);
  for (std::size_t n = 0; n < samples.points.size(); ++n) {
    if (values.states[n] == PointState::kValid && values.values[static_cast<Eigen::Index>(n)] < -inside) {
      blocked[static_cast<std::size_t>(samples.rays[n])] = 1;
    }
  }
  return static_cast<double>(std::count(blocked.begin(), blocked.end(), 1)) / count;
}

}  // namespace ttsdf
