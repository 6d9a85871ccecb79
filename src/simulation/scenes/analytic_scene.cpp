#include "ttsdf_localization/simulation/analytic_scene.h"

#include <stdexcept>

namespace ttsdf {

Eigen::AlignedBox3d AnalyticScene::bounds() const {
  Eigen::AlignedBox3d box;
  for (const auto& solid : solids_) box.extend(solid.boundingBox());
  return box;
}

int AnalyticScene::nearestSolid(const Eigen::Vector3d& p_map, double& distance) const {
  int nearest = -1;
  distance = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < solids_.size(); ++i) {
    const Solid& solid = solids_[i];
    // The bounding sphere bounds the distance from below, outside and inside alike.
    const double reach = distance + solid.boundingRadius();
    if (reach < 0.0 || (p_map - solid.center()).squaredNorm() > reach * reach) continue;
    const double candidate = solid.signedDistance(p_map);
    if (candidate < distance) {
      distance = candidate;
      nearest = static_cast<int>(i);
    }
  }
  return nearest;
}

double AnalyticScene::signedDistance(const Eigen::Vector3d& p_map) const {
  double distance = 0.0;
  nearestSolid(p_map, distance);
  return distance;
}

Eigen::Vector3d AnalyticScene::gradient(const Eigen::Vector3d& p_map) const {
  double distance = 0.0;
  const int nearest = nearestSolid(p_map, distance);
  if (nearest < 0) return Eigen::Vector3d::Zero();
  return solids_[static_cast<std::size_t>(nearest)].normal(p_map);
}

std::optional<RayHit> AnalyticScene::castRay(const Eigen::Vector3d& origin_map,
                                             const Eigen::Vector3d& direction_map,
                                             double max_distance) const {
  const double length = direction_map.norm();
  if (!(length > 0.0) || !std::isfinite(length)) {
    throw std::invalid_argument("castRay: got a direction without length, wanted a finite one");
  }
  const Eigen::Vector3d direction = direction_map / length;
  RayHit hit;
  hit.distance = max_distance;
  for (std::size_t i = 0; i < solids_.size(); ++i) {
    const Solid& solid = solids_[i];
    const Eigen::Vector3d to_center = solid.center() - origin_map;
    const double along = to_center.dot(direction);
    const double radius = solid.boundingRadius();
    if (along + radius < 0.0 || along - radius > hit.distance) continue;
    if (to_center.squaredNorm() - along * along > radius * radius * (1.0 + 1e-9) + 1e-12) continue;
    const double t = solid.intersect(origin_map, direction);
    if (t <= hit.distance && t < std::numeric_limits<double>::infinity()) {
      hit.distance = t;
      hit.solid = static_cast<int>(i);
    }
  }
  if (hit.solid < 0) return std::nullopt;
  hit.point = origin_map + hit.distance * direction;
  hit.normal = solids_[static_cast<std::size_t>(hit.solid)].normal(hit.point);
  return hit;
}

}  // namespace ttsdf
