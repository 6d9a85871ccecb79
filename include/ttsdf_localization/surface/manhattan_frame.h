#pragma once
// The frame of a place built at right angles: a grid turned so that walls follow its axes compresses better
// and needs a smaller box.

#include <Eigen/Geometry>

namespace ttsdf {

struct ManhattanFrame {
  Eigen::Matrix3d R_map_frame = Eigen::Matrix3d::Identity();  ///< columns: the axes, in the map frame
  double share = 0.0;                                         ///< of the area within 10 degrees of an axis
};

/// Robust mode search on unit normals (map frame) weighted with their areas; signs of the normals do not
/// matter. Of the 24 equivalent frames the one turned least. Identity if less than a quarter of the area
/// follows one frame. A single dominant direction fixes one axis, the turn about it stays as small as
/// possible. Throws std::invalid_argument if the sizes differ or nothing has weight.
ManhattanFrame manhattanFrame(const Eigen::Matrix3Xf& normals, const Eigen::VectorXf& areas);

}  // namespace ttsdf
