#pragma once
// Triangles as the search for feet wants them, and which of them lie around a sample.

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "ttsdf_localization/surface/surface_mesh.h"
#include "ttsdf_localization/tensor/dense_tensor.h"

namespace ttsdf {

/// What tells at once where the foot of a sample on a triangle's plane lies, on one line of the cache.
struct alignas(64) BinnedTriangle {
  BinnedTriangle(const Eigen::Vector3f& corner, const Eigen::Vector3f& b, const Eigen::Vector3f& c)
      : a(corner) {
    const Eigen::Vector3f e1 = b - a, e2 = c - a, n = e1.cross(e2);
    const float squared = n.squaredNorm();
    if (!(squared > 0.0F)) return;
    to_b = e2.cross(n) / squared;
    to_c = n.cross(e1) / squared;
    normal = n / std::sqrt(squared);
  }

  /// Signed distance to the plane.
  float above(const Eigen::Vector3f& p) const { return normal.dot(p - a); }

  Eigen::Vector3f a;
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  /// Weights of b and c of a point's foot are to_b . (p - a) and to_c . (p - a). A triangle without area has
  /// no inside.
  Eigen::Vector3f to_b = Eigen::Vector3f::Zero(), to_c = Eigen::Vector3f::Zero();
};

/// Which triangles touch the unit cube around a sample.
class TriangleBins {
 public:
  TriangleBins(const SurfaceMesh& mesh, const std::vector<BinnedTriangle>& triangles, const Dims& dims)
      : mesh_(mesh), dims_(dims) {
    const auto count = static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
                       static_cast<std::size_t>(dims[2]);
    start_.assign(count + 2, 0);
    for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n)
      forEachCube(n, [&](std::size_t cube) { ++start_[cube + 2]; });
    for (std::size_t n = 2; n < start_.size(); ++n) start_[n] += start_[n - 1];
    entries_.resize(start_.back());
    for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
      forEachCube(n, [&](std::size_t cube) { entries_[start_[cube + 1]++] = static_cast<std::int32_t>(n); });
    }
    markFlat(triangles, count);
  }
  const std::int32_t* begin(std::size_t cube) const { return entries_.data() + start_[cube]; }
  const std::int32_t* end(std::size_t cube) const { return entries_.data() + start_[cube + 1]; }
  bool occupied(std::size_t cube) const { return start_[cube] != start_[cube + 1]; }
  bool empty() const { return entries_.empty(); }
  /// Occupied, and all its triangles lie in one plane.
  bool flat(std::size_t cube) const { return flat_[cube] != 0; }

 private:
  void markFlat(const std::vector<BinnedTriangle>& triangles, std::size_t count) {
    flat_.assign(count, 0);
    for (std::size_t cube = 0; cube < count; ++cube) {
      if (!occupied(cube)) continue;
      const BinnedTriangle& first = triangles[static_cast<std::size_t>(*begin(cube))];
      const auto in_plane = [&](int corner) {
        return std::abs(first.above(mesh_.vertices.col(corner))) < kFlat;
      };
      bool flat = first.normal.squaredNorm() > 0.5F;
      for (const auto* n = begin(cube); flat && n != end(cube); ++n) {
        const Eigen::Vector3i t = mesh_.triangles.col(*n);
        flat = in_plane(t[0]) && in_plane(t[1]) && in_plane(t[2]);
      }
      flat_[cube] = flat ? 1 : 0;
    }
  }

  template <class Function>
  void forEachCube(Eigen::Index triangle, const Function& fn) const {
    const Eigen::Vector3i t = mesh_.triangles.col(triangle);
    const Eigen::Array3f a = mesh_.vertices.col(t[0]), b = mesh_.vertices.col(t[1]),
                         c = mesh_.vertices.col(t[2]);
    const Eigen::Array3f low = a.min(b).min(c), high = a.max(b).max(c);
    const Eigen::Array3i first = (low + 0.5F).floor().cast<int>().max(0);
    const Eigen::Array3i last = (high + 0.5F).floor().cast<int>().min(dims_ - 1);
    for (int k = first[2]; k <= last[2]; ++k) {
      for (int j = first[1]; j <= last[1]; ++j) {
        for (int i = first[0]; i <= last[0]; ++i) {
          fn(static_cast<std::size_t>(i) +
             static_cast<std::size_t>(dims_[0]) *
                 (static_cast<std::size_t>(j) +
                  static_cast<std::size_t>(dims_[1]) * static_cast<std::size_t>(k)));
        }
      }
    }
  }

  static constexpr float kFlat = 1e-4F;  // [voxel]

  const SurfaceMesh& mesh_;
  Dims dims_;
  std::vector<std::uint32_t>
      start_;  // filled one ahead, so that the second pass leaves begin and end in place
  std::vector<std::int32_t> entries_;
  std::vector<std::uint8_t> flat_;
};

}  // namespace ttsdf
