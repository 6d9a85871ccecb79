#pragma once
// Boxes that are turned: what a map covers, seen from the atlas.

#include <Eigen/Geometry>

namespace ttsdf {

struct OrientedBox {
  Eigen::Isometry3d T_atlas_box = Eigen::Isometry3d::Identity();  ///< the box is [0, size] in its own frame
  Eigen::Vector3d size = Eigen::Vector3d::Zero();                 ///< [m]

  Eigen::Vector3d centre() const { return T_atlas_box * (0.5 * size); }
  /// Least box along the axes of the atlas that holds it.
  Eigen::AlignedBox3d bounds() const;
  /// Distance to the border [m], positive inside.
  double depth(const Eigen::Vector3d& p_atlas) const;
};

/// How far one box would have to move for the two to be apart [m]; negative or 0: they do not overlap.
double overlapDepth(const OrientedBox& a, const OrientedBox& b);

}  // namespace ttsdf
