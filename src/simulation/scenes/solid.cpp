#include "ttsdf_localization/simulation/solid.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "../ray_kernels.h"

namespace ttsdf {

namespace {

double boxDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& half_extent) {
  const Eigen::Vector3d q = p.cwiseAbs() - half_extent;
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
}

double cylinderDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& half_extent) {
  const Eigen::Vector2d q(p.head<2>().norm() - half_extent.x(), std::abs(p.z()) - half_extent.z());
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
}

/// `v` scaled to unit length, `fallback` where there is no direction to keep.
Eigen::Vector3d directionOr(const Eigen::Vector3d& v, const Eigen::Vector3d& fallback) {
  const double length = v.norm();
  return length > 0.0 ? Eigen::Vector3d(v / length) : fallback;
}

Eigen::Vector3d boxNormal(const Eigen::Vector3d& p, const Eigen::Vector3d& half_extent) {
  const Eigen::Vector3d q = p.cwiseAbs() - half_extent;
  const Eigen::Vector3d side = p.unaryExpr([](double x) { return x < 0.0 ? -1.0 : 1.0; });
  Eigen::Index axis = 0;
  q.maxCoeff(&axis);
  const Eigen::Vector3d face = Eigen::Vector3d::Unit(axis).cwiseProduct(side);
  return directionOr(q.cwiseMax(0.0).cwiseProduct(side), face);
}

Eigen::Vector3d cylinderNormal(const Eigen::Vector3d& p, const Eigen::Vector3d& half_extent) {
  const double rho = p.head<2>().norm();
  const Eigen::Vector2d q(rho - half_extent.x(), std::abs(p.z()) - half_extent.z());
  const Eigen::Vector3d outward =
      rho > 0.0 ? Eigen::Vector3d(p.x() / rho, p.y() / rho, 0.0) : Eigen::Vector3d::UnitX();
  const Eigen::Vector3d along = Eigen::Vector3d::UnitZ() * (p.z() < 0.0 ? -1.0 : 1.0);
  const Eigen::Vector2d outside = q.cwiseMax(0.0);
  return directionOr(outside.x() * outward + outside.y() * along, q.x() > q.y() ? outward : along);
}

}  // namespace

Solid::Solid(SolidShape shape, const Eigen::Isometry3d& T_map_solid, const Eigen::Vector3d& half_extent)
    : shape_(shape),
      T_map_solid_(T_map_solid),
      T_solid_map_(T_map_solid.inverse()),
      center_(T_map_solid.translation()),
      half_extent_(half_extent),
      bounding_radius_(shape == SolidShape::kSphere     ? half_extent.x()
                       : shape == SolidShape::kCylinder ? std::hypot(half_extent.x(), half_extent.z())
                                                        : half_extent.norm()) {
  if (!half_extent.allFinite() || half_extent.minCoeff() <= 0.0) {
    std::ostringstream message;
    message << "solid: got half extent " << half_extent.transpose() << " m, wanted positive finite lengths";
    throw std::invalid_argument(message.str());
  }
  const Eigen::Matrix3d R = T_map_solid.linear();
  if (!T_map_solid.matrix().allFinite() || !(R * R.transpose()).isIdentity(1e-6) || R.determinant() < 0.0) {
    throw std::invalid_argument(
        "solid: got a pose that is not a rigid motion, wanted a rotation and a translation");
  }
}

Solid Solid::box(const Eigen::Isometry3d& T_map_solid, const Eigen::Vector3d& size) {
  return Solid(SolidShape::kBox, T_map_solid, 0.5 * size);
}

Solid Solid::cylinder(const Eigen::Isometry3d& T_map_solid, double radius, double height) {
  return Solid(SolidShape::kCylinder, T_map_solid, Eigen::Vector3d(radius, radius, 0.5 * height));
}

Solid Solid::sphere(const Eigen::Vector3d& center, double radius) {
  return Solid(SolidShape::kSphere, Eigen::Isometry3d(Eigen::Translation3d(center)),
               Eigen::Vector3d::Constant(radius));
}

Eigen::AlignedBox3d Solid::boundingBox() const {
  const Eigen::Vector3d reach = T_map_solid_.linear().cwiseAbs() * half_extent_;
  return {center_ - reach, center_ + reach};
}

double Solid::signedDistance(const Eigen::Vector3d& p_map) const {
  if (shape_ == SolidShape::kSphere) return (p_map - center_).norm() - half_extent_.x();
  const Eigen::Vector3d p = T_solid_map_ * p_map;
  return shape_ == SolidShape::kBox ? boxDistance(p, half_extent_) : cylinderDistance(p, half_extent_);
}

Eigen::Vector3d Solid::normal(const Eigen::Vector3d& p_map) const {
  const Eigen::Vector3d p = T_solid_map_ * p_map;
  switch (shape_) {
    case SolidShape::kBox:
      return T_map_solid_.linear() * boxNormal(p, half_extent_);
    case SolidShape::kCylinder:
      return T_map_solid_.linear() * cylinderNormal(p, half_extent_);
    case SolidShape::kSphere:
      break;
  }
  return directionOr(p_map - center_, Eigen::Vector3d::UnitX());
}

double Solid::intersect(const Eigen::Vector3d& origin_map, const Eigen::Vector3d& direction_map) const {
  const Eigen::Vector3d o = T_solid_map_ * origin_map;
  const Eigen::Vector3d d = T_solid_map_.linear() * direction_map;
  const ray_kernels::Vec<double> origin{o.x(), o.y(), o.z()}, direction{d.x(), d.y(), d.z()};
  const ray_kernels::Vec<double> half{half_extent_.x(), half_extent_.y(), half_extent_.z()};
  switch (shape_) {
    case SolidShape::kBox:
      return ray_kernels::Box::firstHit(origin, direction, half);
    case SolidShape::kCylinder:
      return ray_kernels::Cylinder::firstHit(origin, direction, half);
    case SolidShape::kSphere:
      break;
  }
  return ray_kernels::Sphere::firstHit(origin, direction, half);
}

}  // namespace ttsdf
