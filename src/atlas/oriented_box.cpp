#include "ttsdf_localization/atlas/oriented_box.h"

#include <algorithm>
#include <limits>

namespace ttsdf {

Eigen::AlignedBox3d OrientedBox::bounds() const {
  const Eigen::Vector3d half = T_atlas_box.linear().cwiseAbs() * (0.5 * size), middle = centre();
  return {Eigen::Vector3d(middle - half), Eigen::Vector3d(middle + half)};
}

double OrientedBox::depth(const Eigen::Vector3d& p_atlas) const {
  const Eigen::Vector3d p = T_atlas_box.inverse() * p_atlas;
  const Eigen::Vector3d inside = p.cwiseMin(size - p);
  if (inside.minCoeff() >= 0.0) return inside.minCoeff();
  return -inside.cwiseMin(0.0).norm();
}

// Separating axes: two boxes are apart if one of 15 directions tells them apart.
double overlapDepth(const OrientedBox& a, const OrientedBox& b) {
  const Eigen::Matrix3d A = a.T_atlas_box.linear(), B = b.T_atlas_box.linear();
  const Eigen::Vector3d between = b.centre() - a.centre();
  double least = std::numeric_limits<double>::infinity();
  const auto testAxis = [&](Eigen::Vector3d axis) {
    const double length = axis.norm();
    if (length < 1e-6) return;  // of two parallel edges
    axis /= length;
    const double reach =
        0.5 * ((A.transpose() * axis).cwiseAbs().dot(a.size) + (B.transpose() * axis).cwiseAbs().dot(b.size));
    least = std::min(least, reach - std::abs(between.dot(axis)));
  };
  for (int i = 0; i < 3; ++i) {
    testAxis(A.col(i));
    testAxis(B.col(i));
    for (int j = 0; j < 3; ++j) testAxis(A.col(i).cross(B.col(j)));
  }
  return least;
}

}  // namespace ttsdf
