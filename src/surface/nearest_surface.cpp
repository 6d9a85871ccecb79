#include "ttsdf_localization/surface/nearest_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vigra/multi_array.hxx>
#include <vigra/vector_distance.hxx>

#include "../build_steps/parallel.h"
#include "triangle_bins.h"

namespace ttsdf {
namespace {

using Offsets =
    vigra::TinyVector<short, 3>;  // a third of the memory of int; VIGRA starts from twice the sum of extents

constexpr int kMaxSteps = 6;               // of a descent or of jumps; two are the rule
constexpr int kMaxPasses = 64;             // of exchange between neighbours; ten are the rule
constexpr float kNoNearer = 1.0F - 1e-6F;  // of a squared distance: rounding
constexpr float kSame = 2e-5F;             // distances that differ by so much [voxel] differ by rounding
constexpr auto kNoCube = std::numeric_limits<std::size_t>::max();
constexpr float kSamePlane = 1e-3F;  // [voxel]
constexpr float kOnEdge = 1e-4F;     // a weight as small as this may be one of zero

class Search {
 public:
  Search(const SurfaceMesh& mesh, const Dims& dims, const NearestSurfaceOptions& options)
      : mesh_(mesh), dims_(dims), options_(options), triangles_(unpack(mesh)), bins_(mesh, triangles_, dims) {
    if (bins_.empty() && std::isinf(options.none_beyond))
      throw std::invalid_argument("nearest surface: got no triangle inside the grid, wanted at least one");
  }

  NearestSurface run() {
    const auto count = static_cast<std::size_t>(dims_[0]) * static_cast<std::size_t>(dims_[1]) *
                       static_cast<std::size_t>(dims_[2]);
    result_.triangle.assign(count, -1);
    result_.distance.assign(count, std::numeric_limits<float>::infinity());
    if (bins_.empty()) return std::move(result_);
    transform();
    forEachSlice(0.0, 0.6, [this](const Eigen::Array3i& voxel, std::size_t n) { start(voxel, n); });
    offsets_ = vigra::MultiArray<3, Offsets>();
    settle();
    return std::move(result_);
  }

 private:
  struct Best {
    std::int32_t triangle = -1;
    float squared = std::numeric_limits<float>::max();
    TriangleFoot foot{Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero()};
    /// The last cubes whose triangles were tried: they have nothing to add.
    std::array<std::size_t, 3> tried{kNoCube, kNoCube, kNoCube};
    unsigned tries = 0;

    void take(std::int32_t number, float new_squared, const TriangleFoot& new_foot) {
      triangle = number, squared = new_squared, foot = new_foot;
    }
  };

  static std::vector<BinnedTriangle> unpack(const SurfaceMesh& mesh) {
    std::vector<BinnedTriangle> triangles;
    triangles.reserve(static_cast<std::size_t>(mesh.triangles.cols()));
    for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
      const Eigen::Vector3i t = mesh.triangles.col(n);
      triangles.emplace_back(mesh.vertices.col(t[0]), mesh.vertices.col(t[1]), mesh.vertices.col(t[2]));
    }
    return triangles;
  }

  std::size_t offset(const Eigen::Array3i& v) const {
    return static_cast<std::size_t>(v[0]) +
           static_cast<std::size_t>(dims_[0]) *
               (static_cast<std::size_t>(v[1]) +
                static_cast<std::size_t>(dims_[1]) * static_cast<std::size_t>(v[2]));
  }

  /// Where only near feet are asked for, cells of 2^3 samples are an eighth of the work: the steps along the
  /// surface lead to the same foot. Far out nobody takes those steps.
  void transform() {
    shift_ = std::isinf(options_.none_beyond) ? 0 : 1;
    cells_ = (dims_ + shift_) / (1 + shift_);
    const vigra::Shape3 shape(cells_[0], cells_[1], cells_[2]);
    corners_.reshape(shape);
    corners_.init(0);
    vigra::MultiArray<3, std::uint8_t> surface(shape);
    std::size_t n = 0;
    for (int k = 0; k < dims_[2]; ++k) {
      for (int j = 0; j < dims_[1]; ++j) {
        for (int i = 0; i < dims_[0]; ++i, ++n) {
          if (!bins_.occupied(n)) continue;
          const unsigned corner = shift_ == 0 ? 0U : (i & 1U) | ((j & 1U) << 1) | ((k & 1U) << 2);
          surface(i >> shift_, j >> shift_, k >> shift_) = 1;
          corners_(i >> shift_, j >> shift_, k >> shift_) |= static_cast<std::uint8_t>(1U << corner);
        }
      }
    }
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
    if (std::find(best.tried.begin(), best.tried.end(), cube) != best.tried.end()) return;
    best.tried[best.tries++ % best.tried.size()] = cube;
    // Most feet lie inside a triangle, and the plane distances then rule out the others.
    for (const auto* t = bins_.begin(cube); t != bins_.end(cube); ++t) {
      if (tryInside(p, *t, best)) break;
    }
    for (const auto* t = bins_.begin(cube); t != bins_.end(cube); ++t) tryTriangle(p, *t, best);
  }

  bool tryInside(const Eigen::Vector3f& p, std::int32_t number, Best& best) const {
    const BinnedTriangle& t = triangles_[static_cast<std::size_t>(number)];
    const Eigen::Vector3f d = p - t.a;
    const float b = t.to_b.dot(d), c = t.to_c.dot(d), a = 1.0F - b - c;
    if (!(b > 0.0F && c > 0.0F && a > 0.0F)) return false;
    const float along = t.normal.dot(d);
    if (!(along * along < best.squared)) return false;
    best.take(number, along * along, {p - along * t.normal, {a, b, c}});
    return true;
  }

  /// Over a plane piece of surface the plane says where the foot is, and no other triangle there is nearer.
  /// False, and `best` as it was, where the surface is not plane or ends.
  bool tryPlane(const Eigen::Vector3f& p, std::size_t cube, Best& best) const {
    if (!bins_.flat(cube)) return false;
    const BinnedTriangle& plane = triangles_[static_cast<std::size_t>(*bins_.begin(cube))];
    const float along = plane.above(p);
    const std::size_t target = offset(cubeOf(p - along * plane.normal));
    if (target != cube && !bins_.flat(target)) return false;
    for (const auto* n = bins_.begin(target); n != bins_.end(target); ++n) {
      const BinnedTriangle& t = triangles_[static_cast<std::size_t>(*n)];
      const Eigen::Vector3f d = p - t.a;
      const float b = t.to_b.dot(d), c = t.to_c.dot(d);
      if (!(b > -kOnEdge && c > -kOnEdge && b + c < 1.0F + kOnEdge)) continue;
      const float height = t.normal.dot(d);
      if (std::abs(std::abs(height) - std::abs(along)) > kSamePlane) return false;
      best.triangle = *n;
      best.squared = height * height;
      return true;
    }
    return false;
  }

  void tryTriangle(const Eigen::Vector3f& p, std::int32_t number, Best& best) const {
    const BinnedTriangle& t = triangles_[static_cast<std::size_t>(number)];
    const float along = t.above(p);
    if (along * along >= kNoNearer * best.squared) return;
    const Eigen::Vector3i corners = mesh_.triangles.col(number);
    const TriangleFoot foot =
        closestPoint(p, t.a, mesh_.vertices.col(corners[1]), mesh_.vertices.col(corners[2]));
    const float squared = (p - foot.point).squaredNorm();
    if (squared < best.squared) best.take(number, squared, foot);
  }

  const Offsets& offsetAt(const Eigen::Array3i& v) const {
    return offsets_(v[0] >> shift_, v[1] >> shift_, v[2] >> shift_);
  }

  /// A surface voxel near a sample: the nearest one in the nearest cell that has any.
  Eigen::Array3i surfaceVoxel(const Eigen::Array3i& v) const {
    const Offsets& o = offsetAt(v);
    if (shift_ == 0) return v + Eigen::Array3i(o[0], o[1], o[2]);
    const Eigen::Array3i cell((v[0] >> 1) + o[0], (v[1] >> 1) + o[1], (v[2] >> 1) + o[2]);
    // Of the squared distances to the cell's corners only what the corner's bits add differs: no branches.
    const unsigned corners = corners_(cell[0], cell[1], cell[2]);
    const Eigen::Array3i added = 1 - 2 * (v - 2 * cell);
    int least = std::numeric_limits<int>::max();  // eight times that, and the corner
    for (int corner = 0; corner < 8; ++corner) {
      const int sum = (corner & 1 ? added[0] : 0) + (corner & 2 ? added[1] : 0) + (corner & 4 ? added[2] : 0);
      const int candidate = ((corners >> corner) & 1U) != 0 ? 8 * sum + corner : least;
      least = std::min(least, candidate);
    }
    return 2 * cell + Eigen::Array3i(least & 1, (least >> 1) & 1, (least >> 2) & 1);
  }

  /// Whether all surface is further from a sample than anyone cares: the cells' centres say where it can be
  /// at best.
  bool outOfReach(const Eigen::Array3i& v) const {
    if (std::isinf(options_.none_beyond)) return false;
    constexpr float kSlack = 2.6F;  // half diagonals of a cell and of its samples [voxel]
    const Offsets& o = offsetAt(v);
    const int squared = o[0] * o[0] + o[1] * o[1] + o[2] * o[2];
    const float limit = 0.5F * (options_.none_beyond + kSlack);
    return static_cast<float>(squared) > limit * limit;
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
      const BinnedTriangle& t = triangles_[static_cast<std::size_t>(best.triangle)];
      const Eigen::Vector3f target = p - t.above(p) * t.normal;
      const float squared = best.squared;
      tryCube(p, offset(surfaceVoxel(cubeOf(target))), best);
      if (!(best.squared < squared)) return;
    }
  }

  void start(const Eigen::Array3i& voxel, std::size_t n) {
    if ((options_.wanted && !(*options_.wanted)[n]) || outOfReach(voxel)) return;
    const Eigen::Vector3f p = voxel.cast<float>();
    const std::size_t near = offset(surfaceVoxel(voxel));
    Best best;
    if (!tryPlane(p, near, best)) {
      tryCube(p, near, best);
      if (best.squared <= reach()) {
        jump(p, best);
        descend(p, best);
      }
    }
    result_.triangle[n] = best.triangle;
    result_.distance[n] = std::sqrt(best.squared);
  }

  /// A start may lead to the wrong one of two surfaces (a corner, the two sides of a gap). Feet then wander
  /// from sample to sample until nothing changes: what is left hardly depends on the starts.
  void settle() {
    std::vector<std::vector<Move>> moves(static_cast<std::size_t>(dims_[2]));
    forEachSlice(0.6, 1.0, [&](const Eigen::Array3i& voxel, std::size_t n) {
      const Best best = exchange(voxel, n);
      if (best.triangle >= 0)
        moves[static_cast<std::size_t>(voxel[2])].push_back({n, best.triangle, best.squared});
    });
    std::vector<std::size_t> moved;
    for (const auto& slice : moves) apply(slice, moved);
    for (int pass = 1; pass < kMaxPasses && !moved.empty(); ++pass) {
      const std::vector<std::size_t> around = neighbours(moved);
      std::vector<Best> best(around.size());
      constexpr int kChunk = 256;
      const auto count = static_cast<int>(around.size());
      parallelFor((count + kChunk - 1) / kChunk, options_.threads, [&](int chunk) {
        for (int n = chunk * kChunk; n < std::min(count, (chunk + 1) * kChunk); ++n) {
          const std::size_t sample = around[static_cast<std::size_t>(n)];
          best[static_cast<std::size_t>(n)] = exchange(voxelAt(sample), sample);
        }
      });
      std::vector<Move> next;
      for (std::size_t n = 0; n < around.size(); ++n) {
        if (best[n].triangle >= 0) next.push_back({around[n], best[n].triangle, best[n].squared});
      }
      moved.clear();
      apply(next, moved);
    }
  }

  /// A sample and its new foot.
  struct Move {
    std::size_t sample;
    std::int32_t triangle;
    float squared;
  };
  void apply(const std::vector<Move>& moves, std::vector<std::size_t>& moved) {
    for (const Move& move : moves) {
      result_.triangle[move.sample] = move.triangle;
      result_.distance[move.sample] = std::sqrt(move.squared);
      moved.push_back(move.sample);
    }
  }

  Eigen::Array3i voxelAt(std::size_t n) const {
    const auto n0 = static_cast<std::size_t>(dims_[0]), n1 = static_cast<std::size_t>(dims_[1]);
    return {static_cast<int>(n % n0), static_cast<int>(n / n0 % n1), static_cast<int>(n / n0 / n1)};
  }

  template <class Function>
  void forEachNeighbour(const Eigen::Array3i& voxel, std::size_t n, const Function& fn) const {
    std::size_t step = 1;
    for (int axis = 0; axis < 3; ++axis) {
      if (voxel[axis] > 0) fn(n - step);
      if (voxel[axis] + 1 < dims_[axis]) fn(n + step);
      step *= static_cast<std::size_t>(dims_[axis]);
    }
  }

  std::vector<std::size_t> neighbours(const std::vector<std::size_t>& samples) const {
    std::vector<std::size_t> around;
    around.reserve(6 * samples.size());
    for (const std::size_t n : samples)
      forEachNeighbour(voxelAt(n), n, [&](std::size_t m) { around.push_back(m); });
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    return around;
  }

  /// A neighbour may have found a foot that is nearer to this sample than its own; no triangle if none has.
  Best exchange(const Eigen::Array3i& voxel, std::size_t n) const {
    const std::int32_t own = result_.triangle[n];
    const float distance = result_.distance[n];
    if (own < 0 || distance > options_.exact_within + 2.0F) return {};
    const Eigen::Vector3f p = voxel.cast<float>();
    Best best;
    best.triangle = own;
    const float nearer = std::max(0.0F, distance - kSame);
    best.squared = nearer * nearer;
    forEachNeighbour(voxel, n, [&](std::size_t m) {
      const std::int32_t triangle = result_.triangle[m];
      if (triangle >= 0 && triangle != best.triangle) tryTriangle(p, triangle, best);
    });
    if (best.triangle == own) return {};
    descend(p, best);
    return best;
  }

  float reach() const { return (options_.exact_within + 4.0F) * (options_.exact_within + 4.0F); }

  const SurfaceMesh& mesh_;
  Dims dims_;
  const NearestSurfaceOptions& options_;
  std::vector<BinnedTriangle> triangles_;
  TriangleBins bins_;
  int shift_ = 0;  // cells have 1 << shift_ samples a side
  Dims cells_ = Dims::Zero();
  vigra::MultiArray<3, Offsets> offsets_;       // per cell
  vigra::MultiArray<3, std::uint8_t> corners_;  // per cell, one bit per sample: surface in its cube
  NearestSurface result_;
};

}  // namespace

NearestSurface nearestSurface(const SurfaceMesh& mesh, const Dims& dims,
                              const NearestSurfaceOptions& options) {
  return Search(mesh, dims, options).run();
}

}  // namespace ttsdf
