#include "cloud_normals.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <nanoflann.hpp>
#include <queue>

namespace ttsdf {

namespace {

struct PointSource {
  const Eigen::Matrix3Xf& points;
  std::size_t kdtree_get_point_count() const { return static_cast<std::size_t>(points.cols()); }
  float kdtree_get_pt(std::size_t n, std::size_t axis) const {
    return points(static_cast<Eigen::Index>(axis), static_cast<Eigen::Index>(n));
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, PointSource>,
                                                 PointSource, 3, std::uint32_t>;

}  // namespace

Neighbours nearestNeighbours(const Eigen::Matrix3Xf& points, std::size_t count) {
  const PointSource source{points};
  Tree tree(3, source, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  tree.buildIndex();
  const auto size = static_cast<std::size_t>(points.cols());
  Neighbours result;
  result.count = std::min(count, size);
  result.index.resize(size * result.count);
  result.squared_distance.resize(size * result.count);
  for (std::size_t n = 0; n < size; ++n) {
    tree.knnSearch(points.col(static_cast<Eigen::Index>(n)).data(), result.count,
                   result.index.data() + n * result.count, result.squared_distance.data() + n * result.count);
  }
  return result;
}

Eigen::Matrix3Xf planeNormals(const Eigen::Matrix3Xf& points, const Neighbours& neighbours) {
  Eigen::Matrix3Xf normals(3, points.cols());
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    const std::uint32_t* index = neighbours.index.data() + static_cast<std::size_t>(n) * neighbours.count;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (std::size_t k = 0; k < neighbours.count; ++k) {
      const Eigen::Vector3d d = (points.col(index[k]) - points.col(n)).cast<double>();
      mean += d;
      sum += d * d.transpose();
    }
    const double count = static_cast<double>(neighbours.count);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum / count -
                                                                mean * mean.transpose() / (count * count));
    normals.col(n) = solver.eigenvectors().col(0).cast<float>();
  }
  return normals;
}

void orientTogether(const Eigen::Matrix3Xf& points, const Neighbours& neighbours, bool inside,
                    Eigen::Matrix3Xf& normals) {
  struct Edge {
    float cost;
    std::uint32_t to, from;
    bool operator<(const Edge& other) const { return cost != other.cost ? cost > other.cost : to > other.to; }
  };
  const auto size = static_cast<std::size_t>(points.cols());
  // Neighbourhood is not mutual: both ends get the edge.
  std::vector<std::vector<std::uint32_t>> graph(size);
  for (std::uint32_t n = 0; n < size; ++n) {
    for (std::size_t k = 1; k < neighbours.count; ++k) {
      const std::uint32_t m = neighbours.index[n * neighbours.count + k];
      graph[n].push_back(m);
      graph[m].push_back(n);
    }
  }
  std::vector<char> done(size, 0);
  std::vector<std::uint32_t> piece;
  for (std::uint32_t seed = 0; seed < size; ++seed) {
    if (done[seed]) continue;
    piece.clear();
    std::priority_queue<Edge> open;
    open.push({0.0F, seed, seed});
    while (!open.empty()) {
      const Edge edge = open.top();
      open.pop();
      if (done[edge.to]) continue;
      done[edge.to] = 1;
      piece.push_back(edge.to);
      if (normals.col(edge.to).dot(normals.col(edge.from)) < 0.0F) normals.col(edge.to) *= -1.0F;
      for (const std::uint32_t next : graph[edge.to]) {
        if (!done[next])
          open.push({1.0F - std::abs(normals.col(edge.to).dot(normals.col(next))), next, edge.to});
      }
    }
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const std::uint32_t n : piece) middle += points.col(n).cast<double>();
    middle /= static_cast<double>(piece.size());
    double towards = 0.0;
    for (const std::uint32_t n : piece) {
      towards += normals.col(n).cast<double>().dot(middle - points.col(n).cast<double>());
    }
    if ((towards < 0.0) == inside) {
      for (const std::uint32_t n : piece) normals.col(n) *= -1.0F;
    }
  }
}

}  // namespace ttsdf
