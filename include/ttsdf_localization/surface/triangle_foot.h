#pragma once
// The point of a triangle next to a given one. Inline: searches ask for it some hundred million times.

#include <Eigen/Core>

namespace ttsdf {

/// Closest point of a triangle; weights of its three corners (0: not on that corner's side of the triangle).
struct TriangleFoot {
  Eigen::Vector3f point;
  Eigen::Vector3f weights;
};

// Voronoi regions of the triangle's corners, edges and face in turn (Ericson, Real-Time Collision
// Detection, 5.1.5).
inline TriangleFoot closestPoint(const Eigen::Vector3f& p, const Eigen::Vector3f& a, const Eigen::Vector3f& b,
                                 const Eigen::Vector3f& c) {
  // part / whole, 0 for edges and triangles without extent.
  const auto share = [](float part, float whole) { return whole > 0.0F ? part / whole : 0.0F; };
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

}  // namespace ttsdf
