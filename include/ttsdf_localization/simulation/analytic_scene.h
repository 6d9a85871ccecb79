#pragma once
// A world whose truth is known: a union of solids with its signed distance and its exact ray casting.
//
// In free space (outside every solid) the distance to the union is the smallest distance to a solid, hence
// exact. Inside, the value is minus the largest depth in any one solid: never deeper than the truth, and
// exact wherever the nearest surface belongs to a solid that holds the point and no other solid covers that
// piece of surface. Solids that join must overlap instead of touching; otherwise their common face would be a
// zero crossing inside matter.

#include <Eigen/Geometry>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "ttsdf_localization/simulation/solid.h"

namespace ttsdf {

struct RayHit {
  double distance = 0.0;                              ///< from the origin [m]
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< [m]
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< outward, unit length
  int solid = -1;                                     ///< index into solids()
};

class AnalyticScene {
 public:
  AnalyticScene() = default;
  explicit AnalyticScene(std::vector<Solid> solids) : solids_(std::move(solids)) {}

  void add(const Solid& solid) { solids_.push_back(solid); }
  const std::vector<Solid>& solids() const { return solids_; }
  Eigen::AlignedBox3d bounds() const;

  /// Signed distance [m], positive in free space; infinity in an empty scene. O(solids), most of them
  /// rejected early.
  double signedDistance(const Eigen::Vector3d& p_map) const;
  /// Unit direction of growing distance: the outward normal of the nearest solid.
  Eigen::Vector3d gradient(const Eigen::Vector3d& p_map) const;
  /// First surface along a ray, nothing within `max_distance` [m] otherwise. A solid that holds the origin is
  /// not seen. Throws std::invalid_argument for a direction without length.
  std::optional<RayHit> castRay(const Eigen::Vector3d& origin_map, const Eigen::Vector3d& direction_map,
                                double max_distance = std::numeric_limits<double>::infinity()) const;

 private:
  int nearestSolid(const Eigen::Vector3d& p_map, double& distance) const;

  std::vector<Solid> solids_;
};

}  // namespace ttsdf
