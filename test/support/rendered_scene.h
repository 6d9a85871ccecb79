#pragma once
// Analytic shapes with exact ray ranges and signed distances, and a pinhole camera that renders them: the
// truth for the tests of fusion.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "ttsdf_localization/frames/depth_image.h"

namespace ttsdf::testing {

inline constexpr double kNoHit = std::numeric_limits<double>::infinity();

/// Union of solids; positive distance outside of all.
class Scene {
 public:
  /// Solid half-space { p : normal . p < offset }.
  Scene& plane(const Eigen::Vector3d& normal, double offset) {
    planes_.push_back({normal.normalized(), offset / normal.norm()});
    return *this;
  }
  Scene& sphere(const Eigen::Vector3d& centre, double radius) {
    spheres_.push_back({centre, radius});
    return *this;
  }
  Scene& box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    boxes_.push_back({low, high});
    return *this;
  }
  /// Everything outside of the box is solid.
  Scene& room(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    for (int axis = 0; axis < 3; ++axis) {
      plane(Eigen::Vector3d::Unit(axis), low[axis]);
      plane(-Eigen::Vector3d::Unit(axis), -high[axis]);
    }
    return *this;
  }

  double distance(const Eigen::Vector3d& p) const {
    double least = kNoHit;
    for (const auto& s : planes_) least = std::min(least, s.normal.dot(p) - s.offset);
    for (const auto& s : spheres_) least = std::min(least, (p - s.centre).norm() - s.radius);
    for (const auto& s : boxes_) {
      const Eigen::Vector3d q = (s.low - p).cwiseMax(p - s.high);
      least = std::min(least, q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0));
    }
    return least;
  }

  /// Range of the first hit from outside; kNoHit if none. `direction` has unit length.
  double range(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    double least = kNoHit;
    const auto hit = [&least](double t) { least = t > 0.0 && t < least ? t : least; };
    for (const auto& s : planes_) {
      const double closing = -s.normal.dot(direction);
      if (closing > 0.0) hit((s.normal.dot(origin) - s.offset) / closing);
    }
    for (const auto& s : spheres_) {
      const Eigen::Vector3d to_centre = s.centre - origin;
      const double along = to_centre.dot(direction);
      const double root = s.radius * s.radius - (to_centre - along * direction).squaredNorm();
      if (root >= 0.0) hit(along - std::sqrt(root));
    }
    for (const auto& s : boxes_) {
      double enter = -kNoHit, leave = kNoHit;
      for (int axis = 0; axis < 3; ++axis) {
        const double a = (s.low[axis] - origin[axis]) / direction[axis],
                     b = (s.high[axis] - origin[axis]) / direction[axis];
        enter = std::max(enter, std::min(a, b)), leave = std::min(leave, std::max(a, b));
      }
      if (enter <= leave) hit(enter);
    }
    return least;
  }

 private:
  struct Plane {
    Eigen::Vector3d normal;
    double offset;
  };
  struct Sphere {
    Eigen::Vector3d centre;
    double radius;
  };
  struct Box {
    Eigen::Vector3d low, high;
  };
  std::vector<Plane> planes_;
  std::vector<Sphere> spheres_;
  std::vector<Box> boxes_;
};

inline CameraIntrinsics camera(int width = 320, int height = 240) {
  CameraIntrinsics k;
  k.width = width, k.height = height;
  k.fx = k.fy = 0.9 * width;
  k.cx = 0.5 * width - 0.5, k.cy = 0.5 * height - 0.5;
  return k;
}

inline Eigen::Vector3d pixelRay(const CameraIntrinsics& k, double u, double v) {
  return {(u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0};
}

inline DepthImage render(const Scene& scene, const CameraIntrinsics& k,
                         const Eigen::Isometry3d& T_map_camera) {
  DepthImage image;
  image.width = k.width, image.height = k.height;
  for (int v = 0; v < k.height; ++v) {
    for (int u = 0; u < k.width; ++u) {
      const Eigen::Vector3d ray = pixelRay(k, u, v);
      const double range = scene.range(T_map_camera.translation(), T_map_camera.linear() * ray.normalized());
      image.depth.push_back(range == kNoHit ? 0.0F : static_cast<float>(range / ray.norm()));
    }
  }
  return image;
}

/// Camera at `eye` looking at `target`, image rows roughly along -z of the map.
inline Eigen::Isometry3d lookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  const Eigen::Vector3d up =
      std::abs(forward.z()) < 0.9 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitX();
  const Eigen::Vector3d right = forward.cross(up).normalized();
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() << right, forward.cross(right), forward;
  T.translation() = eye;
  return T;
}

inline double rms(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

}  // namespace ttsdf::testing
