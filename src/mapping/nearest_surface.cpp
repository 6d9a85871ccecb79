#include "ttsdf_localization/mapping/nearest_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vigra/multi_array.hxx>
#include <vigra/vector_distance.hxx>

#include "parallel.h"

namespace ttsdf {
namespace {

using Offsets =
    vigra::TinyVector<short, 3>;  // a third of the memory of int; VIGRA starts from twice the sum of extents

constexpr int kMaxSteps = 6;  // of a descent or of jumps; two are the rule

struct Triangle {
  Eigen::Vector3f a, b, c;
};

/// Which triangles touch the unit cube around a sample.
class TriangleBins {
 public:
  TriangleBins(const std::vector<Triangle>& triangles, const Dims& dims) : dims_(dims) {
    const auto count = static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
                       static_cast<std::size_t>(dims[2]);
    start_.assign(count + 2, 0);
    for (const auto& t : triangles) forEachCube(t, [&](std::size_t cube) { ++start_[cube + 2]; });
    for (std::size_t n = 2; n < start_.size(); ++n) start_[n] += start_[n - 1];
    entries_.resize(start_.back());
    for (std::size_t n = 0; n < triangles.size(); ++n) {
      forEachCube(triangles[n],
                  [&](std::size_t cube) { entries_[start_[cube + 1]++] = static_cast<std::int32_t>(n); });
    }
  }
  const std::int32_t* begin(std::size_t cube) const { return entries_.data() + start_[cube]; }
  const std::int32_t* end(std::size_t cube) const { return entries_.data() + start_[cube + 1]; }
  bool occupied(std::size_t cube) const { return start_[cube] != start_[cube + 1]; }
  bool empty() const { return entries_.empty(); }

 private:
  template <class Function>
  void forEachCube(const Triangle& t, const Function& fn) const {
    const Eigen::Array3f low = t.a.array().min(t.b.array()).min(t.c.array());
    const Eigen::Array3f high = t.a.array().max(t.b.array()).max(t.c.array());
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

  Dims dims_;
  std::vector<std::uint32_t>
      start_;  // filled one ahead, so that the second pass leaves begin and end in place
  std::vector<std::int32_t> entries_;
};

class Search {
 public:
  Search(const SurfaceMesh& mesh, const Dims& dims, const NearestSurfaceOptions& options)
      : dims_(dims), options_(options), triangles_(unpack(mesh)), bins_(triangles_, dims) {
    if (bins_.empty())
      throw std::invalid_argument("nearest surface: got no triangle inside the grid, wanted at least one");
  }

  NearestSurface run() {
    transform();
    const auto count = static_cast<std::size_t>(dims_[0]) * static_cast<std::size_t>(dims_[1]) *
                       static_cast<std::size_t>(dims_[2]);
    result_.triangle.assign(count, -1);
    result_.distance.assign(count, 0.0F);
    forEachSlice(0.0, 0.6, [this](const Eigen::Array3i& voxel, std::size_t n) { start(voxel, n); });
    offsets_ = vigra::MultiArray<3, Offsets>();
    before_ = result_;
    forEachSlice(0.6, 1.0, [this](const Eigen::Array3i& voxel, std::size_t n) { exchange(voxel, n); });
    return std::move(result_);
  }

 private:
  struct Best {
    std::int32_t triangle = -1;
    float squared = std::numeric_limits<float>::max();
    TriangleFoot foot{Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero()};
  };

  static std::vector<Triangle> unpack(const SurfaceMesh& mesh) {
    std::vector<Triangle> triangles(static_cast<std::size_t>(mesh.triangles.cols()));
    for (std::size_t n = 0; n < triangles.size(); ++n) {
      const Eigen::Vector3i t = mesh.triangles.col(static_cast<Eigen::Index>(n));
      triangles[n] = {mesh.vertices.col(t[0]), mesh.vertices.col(t[1]), mesh.vertices.col(t[2])};
    }
    return triangles;
  }

  std::size_t offset(const Eigen::Array3i& v) const {
    return static_cast<std::size_t>(v[0]) +
           static_cast<std::size_t>(dims_[0]) *
               (static_cast<std::size_t>(v[1]) +
                static_cast<std::size_t>(dims_[1]) * static_cast<std::size_t>(v[2]));
  }

  void transform() {
    const vigra::Shape3 shape(dims_[0], dims_[1], dims_[2]);
    vigra::MultiArray<3, std::uint8_t> surface(shape);
    for (std::size_t n = 0; n < static_cast<std::size_t>(surface.size()); ++n)
      surface.data()[n] = bins_.occupied(n) ? 1 : 0;
    offsets_.reshape(shape);
    vigra::separableVectorDistance(surface, offsets_, true);
  }

  template <class Function>
  void forEachSlice(double from, double to, const Function& fn) {
    const int portion = std::max(8 * options_.threads, dims_[2] / 20 + 1);
    for (int begin = 0; begin < dims_[2]; begin += portion) {
      const int size = std::min(portion, dims_[2] - begin);
      parallelFor(size, options_.threads, [&](int slice) {
        std::size_t n = offset({0, 0, begin + slice});
        for (int j = 0; j < dims_[1]; ++j) {
          for (int i = 0; i < dims_[0]; ++i, ++n) fn(Eigen::Array3i(i, j, begin + slice), n);
        }
      });
      if (options_.report) options_.report(from + (to - from) * (begin + size) / dims_[2]);
    }
  }

  void tryCube(const Eigen::Vector3f& p, std::size_t cube, Best& best) const {
    for (const auto* t = bins_.begin(cube); t != bins_.end(cube); ++t) tryTriangle(p, *t, best);
  }
  void tryTriangle(const Eigen::Vector3f& p, std::int32_t number, Best& best) const {
    const Triangle& t = triangles_[static_cast<std::size_t>(number)];
    const TriangleFoot foot = closestPoint(p, t.a, t.b, t.c);
    const float squared = (p - foot.point).squaredNorm();
    if (squared < best.squared) best = {number, squared, foot};
  }

  /// Surface voxel nearest to a sample.
  Eigen::Array3i surfaceVoxel(const Eigen::Array3i& v) const {
    const Offsets& o = offsets_.data()[offset(v)];
    return v + Eigen::Array3i(o[0], o[1], o[2]);
  }

  Eigen::Array3i cubeOf(const Eigen::Vector3f& point) const {
    return (point.array() + 0.5F).floor().cast<int>().max(0).min(dims_ - 1);
  }

  /// Along the surface to a foot that no triangle around it beats.
  void descend(const Eigen::Vector3f& p, Best& best) const {
    Eigen::Array3i last = Eigen::Array3i::Constant(-1);
    for (int step = 0; step < kMaxSteps && best.foot.weights.minCoeff() <= 0.0F; ++step) {
      const Eigen::Array3i cube = cubeOf(best.foot.point);
      if ((cube == last).all()) return;
      last = cube;
      const float squared = best.squared;
      tryCube(p, offset(cube), best);
      if (!(best.squared < squared)) return;
    }
  }

  /// Where the foot lies on the rim of a triangle, the plane of that triangle says where the foot should be.
  void jump(const Eigen::Vector3f& p, Best& best) const {
    for (int step = 0; step < kMaxSteps && best.foot.weights.minCoeff() <= 0.0F; ++step) {
      const Triangle& t = triangles_[static_cast<std::size_t>(best.triangle)];
      const Eigen::Vector3f normal = (t.b - t.a).cross(t.c - t.a).normalized();
      const Eigen::Vector3f target = p - normal.dot(p - t.a) * normal;
      const float squared = best.squared;
      tryCube(p, offset(surfaceVoxel(cubeOf(target))), best);
      if (!(best.squared < squared)) return;
    }
  }

  void start(const Eigen::Array3i& voxel, std::size_t n) {
    const Eigen::Vector3f p = voxel.cast<float>();
    Best best;
    tryCube(p, offset(surfaceVoxel(voxel)), best);
    if (best.squared <= reach()) {
      jump(p, best);
      descend(p, best);
    }
    result_.triangle[n] = best.triangle;
    result_.distance[n] = std::sqrt(best.squared);
  }

  /// A neighbour may have found a foot that is nearer to this sample than its own.
  void exchange(const Eigen::Array3i& voxel, std::size_t n) {
    if (before_.distance[n] > options_.exact_within + 2.0F) return;
    const Eigen::Vector3f p = voxel.cast<float>();
    Best best;
    tryTriangle(p, before_.triangle[n], best);
    const float squared = best.squared;
    for (int axis = 0; axis < 3; ++axis) {
      for (const int side : {-1, 1}) {
        Eigen::Array3i v = voxel;
        v[axis] += side;
        if (v[axis] < 0 || v[axis] >= dims_[axis]) continue;
        const std::int32_t triangle = before_.triangle[offset(v)];
        if (triangle != best.triangle) tryTriangle(p, triangle, best);
      }
    }
    if (best.squared < squared) descend(p, best);
    result_.triangle[n] = best.triangle;
    result_.distance[n] = std::sqrt(best.squared);
  }

  float reach() const { return (options_.exact_within + 4.0F) * (options_.exact_within + 4.0F); }

  Dims dims_;
  const NearestSurfaceOptions& options_;
  std::vector<Triangle> triangles_;
  TriangleBins bins_;
  vigra::MultiArray<3, Offsets> offsets_;
  NearestSurface before_, result_;
};

}  // namespace

NearestSurface nearestSurface(const SurfaceMesh& mesh, const Dims& dims,
                              const NearestSurfaceOptions& options) {
  return Search(mesh, dims, options).run();
}

}  // namespace ttsdf
