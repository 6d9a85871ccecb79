#pragma once
// The primitives that scenes are made of: boxes, cylinders and spheres with a pose, their exact signed
// distance and their exact first intersection with a ray.

#include <Eigen/Geometry>

namespace ttsdf {

enum class SolidShape { kBox, kCylinder, kSphere };

class Solid {
 public:
  /// Sides `size` [m] along the axes of the solid's own frame, centred in it. Throws std::invalid_argument
  /// for a size that is not positive and finite or a pose that is not a rigid motion (so do the other two).
  static Solid box(const Eigen::Isometry3d& T_map_solid, const Eigen::Vector3d& size);
  /// Axis = z of the solid's own frame, centred in it; radius and height [m].
  static Solid cylinder(const Eigen::Isometry3d& T_map_solid, double radius, double height);
  static Solid sphere(const Eigen::Vector3d& center, double radius);

  SolidShape shape() const { return shape_; }
  const Eigen::Isometry3d& pose() const { return T_map_solid_; }         ///< T_map_solid
  const Eigen::Isometry3d& inversePose() const { return T_solid_map_; }  ///< T_solid_map
  const Eigen::Vector3d& center() const { return center_; }
  /// Half the sides of the smallest box of the solid's own frame [m]: (radius, radius, half height) of a
  /// cylinder.
  const Eigen::Vector3d& halfExtent() const { return half_extent_; }
  double boundingRadius() const { return bounding_radius_; }  ///< about the centre [m]
  Eigen::AlignedBox3d boundingBox() const;                    ///< axis-parallel in the map frame

  /// Exact distance to the surface [m], negative inside.
  double signedDistance(const Eigen::Vector3d& p_map) const;
  /// Unit outward normal of the surface nearest to a point (one of them where there are several).
  Eigen::Vector3d normal(const Eigen::Vector3d& p_map) const;
  /// Ray parameter t > 0 of the first point origin + t * direction on the surface, seen from outside;
  /// infinity if the ray misses the solid or starts inside it. `direction` need not have unit length.
  double intersect(const Eigen::Vector3d& origin_map, const Eigen::Vector3d& direction_map) const;

 private:
  Solid(SolidShape shape, const Eigen::Isometry3d& T_map_solid, const Eigen::Vector3d& half_extent);

  SolidShape shape_;
  Eigen::Isometry3d T_map_solid_, T_solid_map_;
  Eigen::Vector3d center_, half_extent_;
  double bounding_radius_;
};

}  // namespace ttsdf
