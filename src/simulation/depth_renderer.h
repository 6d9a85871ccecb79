#pragma once
// Exact rendering: every solid in view is tested against the rays of the pixels that its outline can cover.

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "ttsdf_localization/frames/depth_image.h"
#include "ttsdf_localization/simulation/solid.h"

namespace ttsdf {

/// A solid as one picture sees it.
struct VisibleSolid {
  const Solid* solid = nullptr;
  Eigen::Matrix3d R_solid_camera;      ///< turns pixel directions into the solid's frame
  Eigen::Vector3d origin;              ///< optical centre in the solid's frame [m]
  int u_begin, u_end, v_begin, v_end;  ///< pixels it can cover
  double nearest = 0.0;                ///< smallest depth of its bounding box [m]
};

/// Pixels in depth order of what can be seen within `max_range`, nearest first.
std::vector<VisibleSolid> visibleSolids(const std::vector<const Solid*>& solids,
                                        const CameraIntrinsics& intrinsics,
                                        const Eigen::Isometry3d& T_map_camera, double max_range);

/// One row of the picture: depth [m] (infinity: nothing) and index into the list above (-1: nothing) per
/// column. Indices are doubles so that the loops stay one vector type.
struct RowBuffer {
  std::vector<double> depth, index;
};
void renderRow(const std::vector<VisibleSolid>& visible, const CameraIntrinsics& intrinsics, int v,
               RowBuffer& row);

/// Cosine of the angle between a pixel's ray and the surface's normal it hits.
double incidenceCosine(const VisibleSolid& visible, const CameraIntrinsics& intrinsics, int u, int v,
                       double depth);

}  // namespace ttsdf
