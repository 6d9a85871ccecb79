#include "mesh_sides.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "../build_steps/parallel.h"

namespace ttsdf {
namespace {

constexpr float kShell =
    0.5F;  // [voxel]: of two neighbours on different sides, one is at most that far from the mesh

class Flood {
 public:
  Flood(const NearestSurface& nearest, const Dims& dims) : nearest_(nearest), dims_(dims) {
    n0_ = static_cast<std::size_t>(dims[0]);
    n01_ = n0_ * static_cast<std::size_t>(dims[1]);
  }

  std::vector<std::uint8_t> outside() {
    outside_.assign(nearest_.distance.size(), 0);
    for (int k = 0; k < dims_[2]; ++k) {
      for (int j = 0; j < dims_[1]; ++j) {
        const bool rim = k == 0 || j == 0 || k + 1 == dims_[2] || j + 1 == dims_[1];
        for (int i = 0; i < dims_[0]; i += rim ? 1 : std::max(1, dims_[0] - 1)) visit(i, j, k);
      }
    }
    while (!open_.empty()) {
      const Eigen::Array3i v = open_.back();
      open_.pop_back();
      for (int axis = 0; axis < 3; ++axis) {
        for (const int side : {-1, 1}) {
          Eigen::Array3i w = v;
          w[axis] += side;
          if (w[axis] >= 0 && w[axis] < dims_[axis]) visit(w[0], w[1], w[2]);
        }
      }
    }
    return std::move(outside_);
  }

 private:
  void visit(int i, int j, int k) {
    const std::size_t n =
        static_cast<std::size_t>(i) + n0_ * static_cast<std::size_t>(j) + n01_ * static_cast<std::size_t>(k);
    if (outside_[n] || nearest_.distance[n] <= kShell) return;
    outside_[n] = 1;
    open_.emplace_back(i, j, k);
  }

  const NearestSurface& nearest_;
  Dims dims_;
  std::size_t n0_ = 0, n01_ = 0;
  std::vector<std::uint8_t> outside_;
  std::vector<Eigen::Array3i> open_;
};

Eigen::Vector3f footOf(const SurfaceMesh& mesh, std::int32_t triangle, const Eigen::Vector3f& p) {
  const Eigen::Vector3i t = mesh.triangles.col(triangle);
  return closestPoint(p, mesh.vertices.col(t[0]), mesh.vertices.col(t[1]), mesh.vertices.col(t[2])).point;
}

}  // namespace

std::vector<std::uint8_t> enclosedSamples(const SurfaceMesh& mesh, const NearestSurface& nearest,
                                          const Dims& dims, int threads) {
  const std::vector<std::uint8_t> outside = Flood(nearest, dims).outside();
  std::vector<std::uint8_t> enclosed(outside.size(), 0);
  const auto offset = [&](const Eigen::Array3i& v) {
    return static_cast<std::size_t>(v[0]) +
           static_cast<std::size_t>(dims[0]) *
               (static_cast<std::size_t>(v[1]) +
                static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(v[2]));
  };
  /// Votes of the 26 neighbours beyond the shell. One counts if it lies on this sample's side of the mesh and
  /// this sample on its: near an edge either test alone would look round the corner.
  const auto votesForInside = [&](const Eigen::Array3i& v, std::size_t n) {
    const Eigen::Vector3f p = v.cast<float>(), foot = footOf(mesh, nearest.triangle[n], p);
    const Eigen::Vector3f way = (p - foot).normalized();
    float balance = 0.0F;
    for (int neighbour = 0; neighbour < 27; ++neighbour) {
      const Eigen::Array3i w =
          v + Eigen::Array3i(neighbour % 3 - 1, neighbour / 3 % 3 - 1, neighbour / 9 - 1);
      if ((w < 0).any() || (w >= dims).any()) continue;
      const std::size_t m = offset(w);
      if (nearest.distance[m] <= kShell) continue;
      const Eigen::Vector3f q = w.cast<float>(), other_foot = footOf(mesh, nearest.triangle[m], q);
      const float weight = way.dot((q - foot).normalized());
      if (weight > 0.0F && (p - other_foot).dot(q - other_foot) > 0.0F)
        balance += outside[m] ? -weight : weight;
    }
    return balance > 0.0F;
  };
  parallelFor(dims[2], threads, [&](int k) {
    std::size_t n = offset({0, 0, k});
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i, ++n) {
        const bool in_shell = nearest.distance[n] <= kShell;
        enclosed[n] = in_shell ? votesForInside({i, j, k}, n) : !outside[n];
      }
    }
  });
  return enclosed;
}

double orientedShare(const SurfaceMesh& mesh) {
  struct Edge {
    int low, high;
    bool forward;
    bool operator<(const Edge& other) const { return low != other.low ? low < other.low : high < other.high; }
  };
  std::vector<Edge> edges;
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
    for (int e = 0; e < 3; ++e) {
      const int a = mesh.triangles(e, n), b = mesh.triangles((e + 1) % 3, n);
      edges.push_back({std::min(a, b), std::max(a, b), a < b});
    }
  }
  std::sort(edges.begin(), edges.end());
  std::size_t good = 0, all = 0;
  for (std::size_t n = 0; n < edges.size();) {
    std::size_t end = n + 1;
    while (end < edges.size() && !(edges[n] < edges[end])) ++end;
    if (end == n + 2 && edges[n].forward != edges[n + 1].forward) ++good;
    ++all;
    n = end;
  }
  return all == 0 ? 0.0 : static_cast<double>(good) / static_cast<double>(all);
}

double enclosedVolume(const SurfaceMesh& mesh) {
  const Eigen::Vector3d center = mesh.vertices.cast<double>().rowwise().mean();
  double volume = 0.0;
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
    Eigen::Matrix3d corners;
    for (int c = 0; c < 3; ++c)
      corners.col(c) = mesh.vertices.col(mesh.triangles(c, n)).cast<double>() - center;
    volume += corners.determinant() / 6.0;
  }
  return volume;
}

}  // namespace ttsdf
