#pragma once
// What an ideal depth camera would leave of a place whose distance is known: band on both sides of the
// surface, free space before it, nothing known behind it.

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "ttsdf_localization/surface/observed_grid.h"

namespace ttsdf::testing {

using Distance = std::function<double(const Eigen::Vector3d& p_map)>;  ///< signed [m], positive in free space
using Seen = std::function<bool(const Eigen::Vector3d& p_map)>;

inline ObservedGrid observe(const Distance& distance, const Dims& dims, const Eigen::Array3i& origin,
                            double voxel_size, double truncation, const Seen& seen = {}) {
  ObservedGrid grid;
  grid.dims = dims;
  grid.origin = origin;
  grid.voxel_size = voxel_size;
  grid.truncation = truncation;
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i) {
        const Eigen::Vector3d p = voxel_size * (origin + Eigen::Array3i(i, j, k)).cast<double>().matrix();
        const double d = distance(p);
        Observation state = Observation::kBand;
        if (d > truncation) state = Observation::kFree;
        if (d < -truncation || (seen && !seen(p))) state = Observation::kUnknown;
        grid.state.push_back(state);
        grid.tsdf.push_back(static_cast<float>(std::clamp(d, -truncation, truncation)));
      }
    }
  }
  return grid;
}

/// Exact distance to a box, negative inside.
inline double boxDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& half_size) {
  const Eigen::Array3d q = p.array().abs() - half_size.array();
  return q.max(0.0).matrix().norm() + std::min(q.maxCoeff(), 0.0);
}

/// (The blocks reach below the floor: a bottom face at the floor would be a surface inside matter.)
/// A room of 3.4 x 2.6 x 2.2 m about the origin of its own frame, with a table block, a turned crate and a
/// ball. Exact in free space; behind the walls exact but for the outer corners.
inline double roomDistance(const Eigen::Vector3d& p) {
  const Eigen::Vector3d half(1.7, 1.3, 1.1);
  const Eigen::Array3d to_wall = half.array() - p.array().abs();
  double d = to_wall.minCoeff();
  if (d < 0.0) d = -to_wall.min(0.0).matrix().norm();
  d = std::min(d, boxDistance(p - Eigen::Vector3d(-0.9, 0.4, -1.0), {0.4, 0.3, 0.55}));
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  d = std::min(d, boxDistance(turn * (p - Eigen::Vector3d(0.8, -0.4, -0.95)), {0.3, 0.2, 0.7}));
  return std::min(d, (p - Eigen::Vector3d(0.6, 0.6, 0.2)).norm() - 0.3);
}

}  // namespace ttsdf::testing
