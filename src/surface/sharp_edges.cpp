#include "sharp_edges.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "../build_steps/parallel.h"

namespace ttsdf {
namespace {

constexpr int kRings = 3;
constexpr float kFlatCosine = 0.97F;        // a vertex is flat if its quadrilaterals agree to 14 degrees
constexpr float kSamePlaneCosine = 0.94F;   // 20 degrees
constexpr float kOtherPlaneCosine = 0.82F;  // 35 degrees
constexpr float kFlatness = 0.1F;           // rms distance from a plane [voxel]
constexpr float kMaxMove = 1.2F;            // [voxel]
constexpr std::size_t kMinEdgePoints = 5;

struct Plane {
  Eigen::Vector3f normal;
  float offset;
};

class Sharpener {
 public:
  Sharpener(const std::vector<Eigen::Vector3f>& vertices, const Quads& quads)
      : vertices_(vertices), quads_(quads) {
    start_.assign(vertices.size() + 2, 0);
    for (const auto& q : quads) {
      for (const int n : q) ++start_[static_cast<std::size_t>(n) + 2];
    }
    for (std::size_t n = 2; n < start_.size(); ++n) start_[n] += start_[n - 1];
    quad_of_.resize(start_.back());
    for (std::size_t n = 0; n < quads.size(); ++n) {
      for (const int v : quads[n]) quad_of_[start_[static_cast<std::size_t>(v) + 1]++] = static_cast<int>(n);
    }
    describeVertices();
  }

  /// New place of a vertex; false: it stays.
  bool sharpen(int vertex, Eigen::Vector3f& place) const {
    if (flat_[static_cast<std::size_t>(vertex)]) return false;
    std::vector<int> flat_around = flatSurroundings(vertex);
    std::vector<Plane> planes;
    if (!findPlanes(std::move(flat_around), planes) || planes.size() < 2) return false;
    // Least squares with a weak pull to the old place: along an edge the planes say nothing.
    const Eigen::Vector3f& old = vertices_[static_cast<std::size_t>(vertex)];
    constexpr float kPull = 1e-3F;
    Eigen::Matrix3f A = kPull * Eigen::Matrix3f::Identity();
    Eigen::Vector3f b = Eigen::Vector3f::Zero();
    for (const auto& plane : planes) {
      A += plane.normal * plane.normal.transpose();
      b -= plane.normal * (plane.normal.dot(old) - plane.offset);
    }
    place = old + A.ldlt().solve(b);
    return (place - old).norm() <= kMaxMove;
  }

 private:
  Eigen::Vector3f quadNormal(int quad) const {
    const auto& q = quads_[static_cast<std::size_t>(quad)];
    const auto at = [&](std::size_t c) -> const Eigen::Vector3f& {
      return vertices_[static_cast<std::size_t>(q[c])];
    };
    return (at(2) - at(0)).cross(at(3) - at(1));
  }

  void describeVertices() {
    std::vector<Eigen::Vector3f> quad_normals(quads_.size());
    for (std::size_t n = 0; n < quads_.size(); ++n) quad_normals[n] = quadNormal(static_cast<int>(n));
    normals_.assign(vertices_.size(), Eigen::Vector3f::Zero());
    flat_.assign(vertices_.size(), 0);
    for (std::size_t v = 0; v < vertices_.size(); ++v) {
      for (std::size_t n = start_[v]; n < start_[v + 1]; ++n)
        normals_[v] += quad_normals[static_cast<std::size_t>(quad_of_[n])];
      const float area = normals_[v].norm();
      if (!(area > 0.1F)) continue;  // nothing but slivers around it
      normals_[v] /= area;
      bool flat = true;
      for (std::size_t n = start_[v]; n < start_[v + 1] && flat; ++n) {
        const Eigen::Vector3f& normal = quad_normals[static_cast<std::size_t>(quad_of_[n])];
        const float length = normal.norm();
        flat = length < 0.02F || normal.dot(normals_[v]) > kFlatCosine * length;  // slivers have no direction
      }
      flat_[v] = flat ? 1 : 0;
    }
  }

  std::vector<int> flatSurroundings(int vertex) const {
    std::vector<int> seen{vertex}, flat;
    std::size_t ring_begin = 0;
    for (int ring = 0; ring < kRings; ++ring) {
      const std::size_t ring_end = seen.size();
      for (std::size_t n = ring_begin; n < ring_end; ++n) {
        const auto v = static_cast<std::size_t>(seen[n]);
        for (std::size_t q = start_[v]; q < start_[v + 1]; ++q) {
          for (const int other : quads_[static_cast<std::size_t>(quad_of_[q])]) {
            if (std::find(seen.begin(), seen.end(), other) != seen.end()) continue;
            seen.push_back(other);
            if (flat_[static_cast<std::size_t>(other)]) flat.push_back(other);
          }
        }
      }
      ring_begin = ring_end;
    }
    return flat;
  }

  /// One plane after the other, each seeded by the vertex whose normal differs most from those found. False
  /// if the surroundings are not made of planes.
  bool findPlanes(std::vector<int> around, std::vector<Plane>& planes) const {
    while (around.size() >= kMinEdgePoints && planes.size() < 3) {
      std::size_t seed = 0;
      float smallest = std::numeric_limits<float>::max();
      for (std::size_t n = 0; n < around.size(); ++n) {
        float cosine = -1.0F;
        for (const auto& plane : planes) cosine = std::max(cosine, plane.normal.dot(normal(around[n])));
        if (cosine < smallest) smallest = cosine, seed = n;
      }
      if (smallest > kOtherPlaneCosine) break;
      const Eigen::Vector3f direction = normal(around[seed]);
      const auto rest = std::partition(around.begin(), around.end(),
                                       [&](int v) { return normal(v).dot(direction) < kSamePlaneCosine; });
      const std::vector<int> members(rest, around.end());
      around.erase(rest, around.end());
      if (members.size() < kMinEdgePoints) continue;
      Plane plane{};
      if (!fit(members, plane)) return false;
      planes.push_back(plane);
    }
    return true;
  }

  bool fit(const std::vector<int>& members, Plane& plane) const {
    Eigen::Vector3f mean = Eigen::Vector3f::Zero(), direction = Eigen::Vector3f::Zero();
    for (const int v : members) mean += vertices_[static_cast<std::size_t>(v)], direction += normal(v);
    mean /= static_cast<float>(members.size());
    Eigen::Matrix3f covariance = Eigen::Matrix3f::Zero();
    for (const int v : members) {
      const Eigen::Vector3f d = vertices_[static_cast<std::size_t>(v)] - mean;
      covariance += d * d.transpose();
    }
    covariance /= static_cast<float>(members.size());
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver(covariance);
    // A line of points has no plane.
    if (solver.eigenvalues()[0] > kFlatness * kFlatness || solver.eigenvalues()[1] < 0.15F) return false;
    plane.normal = solver.eigenvectors().col(0);
    if (plane.normal.dot(direction) < 0.0F) plane.normal = -plane.normal;
    plane.offset = plane.normal.dot(mean);
    return true;
  }

  const Eigen::Vector3f& normal(int v) const { return normals_[static_cast<std::size_t>(v)]; }

  const std::vector<Eigen::Vector3f>& vertices_;
  const Quads& quads_;
  std::vector<std::size_t> start_;  // quadrilaterals of vertex v: quad_of_[start_[v] .. start_[v + 1])
  std::vector<int> quad_of_;
  std::vector<Eigen::Vector3f> normals_;
  std::vector<std::uint8_t> flat_;
};

}  // namespace

std::vector<std::uint8_t> sharpenEdges(std::vector<Eigen::Vector3f>& vertices, const Quads& quads,
                                       int threads) {
  const Sharpener sharpener(vertices, quads);
  std::vector<std::uint8_t> moved(vertices.size(), 0);
  std::vector<Eigen::Vector3f> places = vertices;
  constexpr int kPortion = 1024;
  const int portions = static_cast<int>((vertices.size() + kPortion - 1) / kPortion);
  parallelFor(portions, threads, [&](int portion) {
    const std::size_t begin = static_cast<std::size_t>(portion) * kPortion;
    for (std::size_t n = begin; n < std::min(vertices.size(), begin + kPortion); ++n) {
      Eigen::Vector3f place;
      if (!sharpener.sharpen(static_cast<int>(n), place)) continue;
      places[n] = place;
      moved[n] = 1;
    }
  });
  vertices = std::move(places);
  return moved;
}

}  // namespace ttsdf
