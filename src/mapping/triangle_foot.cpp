#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "ttsdf_localization/mapping/nearest_surface.h"

namespace ttsdf {

namespace {

/// part / whole, 0 for edges and triangles without extent.
float share(float part, float whole) { return whole > 0.0F ? part / whole : 0.0F; }

}  // namespace

// Voronoi regions of the triangle's corners, edges and face in turn (Ericson, Real-Time Collision
// Detection, 5.1.5).
TriangleFoot closestPoint(const Eigen::Vector3f& p, const Eigen::Vector3f& a, const Eigen::Vector3f& b,
                          const Eigen::Vector3f& c) {
  const Eigen::Vector3f ab = b - a, ac = c - a, ap = p - a;
  const float d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0.0F && d2 <= 0.0F) return {a, {1.0F, 0.0F, 0.0F}};
  const Eigen::Vector3f bp = p - b;
  const float d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0.0F && d4 <= d3) return {b, {0.0F, 1.0F, 0.0F}};
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0F && d1 >= 0.0F && d3 <= 0.0F) {
    const float v = share(d1, d1 - d3);
    return {a + v * ab, {1.0F - v, v, 0.0F}};
  }
  const Eigen::Vector3f cp = p - c;
  const float d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0.0F && d5 <= d6) return {c, {0.0F, 0.0F, 1.0F}};
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0F && d2 >= 0.0F && d6 <= 0.0F) {
    const float w = share(d2, d2 - d6);
    return {a + w * ac, {1.0F - w, 0.0F, w}};
  }
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0.0F && d4 - d3 >= 0.0F && d5 - d6 >= 0.0F) {
    const float w = share(d4 - d3, (d4 - d3) + (d5 - d6));
    return {b + w * (c - b), {0.0F, 1.0F - w, w}};
  }
  const float denominator = va + vb + vc;
  const float v = share(vb, denominator), w = share(vc, denominator);
  return {a + v * ab + w * ac, {1.0F - v - w, v, w}};
}

SurfaceMesh subdivided(const SurfaceMesh& mesh, float max_edge) {
  std::vector<Eigen::Vector3f> vertices;
  for (Eigen::Index n = 0; n < mesh.vertices.cols(); ++n) vertices.emplace_back(mesh.vertices.col(n));
  std::map<std::pair<int, int>, int> middle_of;
  const auto middle = [&](int a, int b) {
    const auto [entry, is_new] = middle_of.try_emplace(std::minmax(a, b), static_cast<int>(vertices.size()));
    if (is_new) {
      vertices.emplace_back(0.5F *
                            (vertices[static_cast<std::size_t>(a)] + vertices[static_cast<std::size_t>(b)]));
    }
    return entry->second;
  };
  std::vector<Eigen::Vector3i> open, done;
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) open.emplace_back(mesh.triangles.col(n));
  // Always the longest edge of a triangle: both triangles of an edge that is too long split it at the same
  // point.
  while (!open.empty()) {
    const Eigen::Vector3i t = open.back();
    open.pop_back();
    int longest = 0;
    float length = 0.0F;
    for (int e = 0; e < 3; ++e) {
      const float candidate =
          (vertices[static_cast<std::size_t>(t[e])] - vertices[static_cast<std::size_t>(t[(e + 1) % 3])])
              .norm();
      if (candidate > length) length = candidate, longest = e;
    }
    if (!(length > max_edge)) {
      done.push_back(t);
      continue;
    }
    const int a = t[longest], b = t[(longest + 1) % 3], c = t[(longest + 2) % 3];
    const int m = middle(a, b);
    open.emplace_back(a, m, c);
    open.emplace_back(m, b, c);
  }
  SurfaceMesh result;
  result.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t n = 0; n < vertices.size(); ++n)
    result.vertices.col(static_cast<Eigen::Index>(n)) = vertices[n];
  result.triangles.resize(3, static_cast<Eigen::Index>(done.size()));
  for (std::size_t n = 0; n < done.size(); ++n) result.triangles.col(static_cast<Eigen::Index>(n)) = done[n];
  return result;
}

}  // namespace ttsdf
