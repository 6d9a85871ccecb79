#include <map>
#include <utility>
#include <vector>

#include "ttsdf_localization/surface/nearest_surface.h"

namespace ttsdf {

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
