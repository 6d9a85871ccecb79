#include <Eigen/Geometry>
#include <numeric>

#include "triangle_soup.h"

namespace ttsdf {

namespace {

using Corners = std::vector<Eigen::Vector3d>;

/// Newell's normal: right for concave and slightly bent polygons, too.
Eigen::Vector3d normalOf(const Corners& p) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (std::size_t n = 0; n < p.size(); ++n) {
    normal += (p[n] - p[0]).cross(p[(n + 1) % p.size()] - p[0]);
  }
  return normal;
}

double turn(const Eigen::Vector3d& normal, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
            const Eigen::Vector3d& c) {
  return normal.dot((b - a).cross(c - b));
}

bool isConvex(const Corners& p, const Eigen::Vector3d& normal) {
  for (std::size_t n = 0; n < p.size(); ++n) {
    if (turn(normal, p[n], p[(n + 1) % p.size()], p[(n + 2) % p.size()]) < 0.0) return false;
  }
  return true;
}

bool contains(const Eigen::Vector3d& normal, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
              const Eigen::Vector3d& c, const Eigen::Vector3d& p) {
  const auto left = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return normal.dot((to - from).cross(p - from)) >= 0.0;
  };
  return p != a && p != b && p != c && left(a, b) && left(b, c) && left(c, a);
}

/// The place in `left` of a corner whose triangle holds no other corner; -1 if there is none.
int findEar(const Corners& p, const Eigen::Vector3d& normal, const std::vector<int>& left) {
  const std::size_t count = left.size();
  const auto corner = [&](std::size_t n) -> const Eigen::Vector3d& {
    return p[static_cast<std::size_t>(left[n % count])];
  };
  for (std::size_t n = 0; n < count; ++n) {
    const Eigen::Vector3d &a = corner(n + count - 1), &b = corner(n), &c = corner(n + 1);
    if (turn(normal, a, b, c) <= 0.0) continue;
    bool empty = true;
    for (std::size_t m = 0; m < count && empty; ++m) empty = !contains(normal, a, b, c, corner(m));
    if (empty) return static_cast<int>(n);
  }
  return -1;
}

}  // namespace

void splitPolygon(const Corners& corners, std::vector<int>& split) {
  split.clear();
  const Eigen::Vector3d normal = normalOf(corners);
  std::vector<int> left(corners.size());
  std::iota(left.begin(), left.end(), 0);
  if (corners.size() > 3 && !isConvex(corners, normal)) {
    while (left.size() > 3) {
      const int ear = findEar(corners, normal, left);
      if (ear < 0) break;  // it crosses itself: any triangles are as good as others
      const std::size_t n = static_cast<std::size_t>(ear), count = left.size();
      split.insert(split.end(), {left[(n + count - 1) % count], left[n], left[(n + 1) % count]});
      left.erase(left.begin() + ear);
    }
  }
  for (std::size_t n = 2; n < left.size(); ++n) split.insert(split.end(), {left[0], left[n - 1], left[n]});
}

}  // namespace ttsdf
