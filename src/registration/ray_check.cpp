#include "ray_check.h"

#include <algorithm>

namespace ttsdf {

namespace {
constexpr double kStepVoxels = 1.5;
constexpr float kBeforeEnd = 0.15f;   // [m] the surface itself, seen at a flat angle, with noise
constexpr double kInsideVoxels = 1.5;  // deeper than this in matter is an obstacle
constexpr float kLongest = 20.0f;      // [m] bounds the cost
}  // namespace

double blockedShare(const DistanceField& field, const ScanBuffer& scan, const Eigen::Isometry3d& T_map_sensor,
                    int rays) {
  const double voxel = field.geometry().voxel_size;
  const auto step = static_cast<float>(kStepVoxels * voxel), inside = static_cast<float>(kInsideVoxels * voxel);
  const Eigen::Isometry3f T = T_map_sensor.cast<float>();
  const Eigen::Vector3f centroid = scan.centroid().cast<float>();
  const int stride = std::max(1, scan.size() / std::max(1, rays));
  int looked = 0, blocked = 0;
  for (int n = 0; n < scan.size(); n += stride) {
    const Eigen::Vector3f end = centroid + Eigen::Vector3f(scan.x()[n], scan.y()[n], scan.z()[n]);
    const float range = std::min(end.norm(), kLongest);
    const auto samples = static_cast<Eigen::Index>((range - kBeforeEnd) / step);
    if (samples < 1) continue;
    const Eigen::Vector3f direction = T.linear() * end.normalized();
    Eigen::Matrix3Xf points(3, samples);
    for (Eigen::Index s = 0; s < samples; ++s) {
      points.col(s) = T.translation() + static_cast<float>(s + 1) * step * direction;
    }
    const FieldSamples values = field.evaluate(points);
    bool hit = false;
    for (Eigen::Index s = 0; s < samples && !hit; ++s) {
      hit = values.states[static_cast<std::size_t>(s)] == PointState::kValid && values.values[s] < -inside;
    }
    ++looked;
    blocked += hit ? 1 : 0;
  }
  return looked > 0 ? static_cast<double>(blocked) / looked : 0.0;
}

}  // namespace ttsdf
