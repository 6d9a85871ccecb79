#pragma once
// Normals of points: planes through neighbours, turned the same way from neighbour to neighbour (Hoppe et
// al., "Surface reconstruction from unorganized points", 1992).

#include <Eigen/Core>
#include <vector>

namespace ttsdf {

/// Nearest neighbours of every point, itself first. Distances in the same order.
struct Neighbours {
  std::size_t count = 0;  ///< per point
  std::vector<std::uint32_t> index;
  std::vector<float> squared_distance;
};
Neighbours nearestNeighbours(const Eigen::Matrix3Xf& points, std::size_t count);

/// Unit normals without a meaning of their sign.
Eigen::Matrix3Xf planeNormals(const Eigen::Matrix3Xf& points, const Neighbours& neighbours);

/// Turns them the same way along a minimum spanning tree of neighbours that agree most; each connected piece
/// as a whole towards (or, if `inside` is false, away from) its own middle.
void orientTogether(const Eigen::Matrix3Xf& points, const Neighbours& neighbours, bool inside,
                    Eigen::Matrix3Xf& normals);

}  // namespace ttsdf
