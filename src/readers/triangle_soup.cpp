#include "triangle_soup.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <unordered_map>

namespace ttsdf {

namespace {

constexpr std::size_t kMostCorners = 10000;    // of a polygon
constexpr std::size_t kMostConcaveWork = 500;  // corners of a polygon that must be cut ear by ear

/// Equal coordinates, -0 and 0 among them.
struct VertexHash {
  std::size_t operator()(const std::array<double, 3>& v) const {
    std::size_t hash = 0;
    for (const double x : v) hash = hash * 1000003u ^ std::hash<double>()(x + 0.0);
    return hash;
  }
};

}  // namespace

void TriangleSoup::addPolygon(const std::vector<std::int64_t>& corners) {
  if (corners.size() < 3) return;
  if (corners.size() > kMostCorners) {
    file_.fail("got a polygon of " + std::to_string(corners.size()) + " corners, wanted up to " +
               std::to_string(kMostCorners));
  }
  polygons_.push_back({corners_.size(), corners.size()});
  corners_.insert(corners_.end(), corners.begin(), corners.end());
}

void TriangleSoup::addStrip(const std::vector<std::int64_t>& corners) {
  std::vector<std::int64_t> triangle;
  std::size_t first = 0;
  for (std::size_t n = 0; n < corners.size(); ++n) {
    if (corners[n] == -1) {
      first = n + 1;
    } else if (n >= first + 2) {
      const bool turned = (n - first) % 2 != 0;
      triangle = {corners[n - 2], corners[n - 1], corners[n]};
      if (turned) std::swap(triangle[0], triangle[1]);
      addPolygon(triangle);
    }
  }
}

void TriangleSoup::checkCorner(std::int64_t corner, std::size_t polygon) const {
  if (corner < 0 || corner >= static_cast<std::int64_t>(vertices_.size())) {
    file_.fail("got vertex index " + std::to_string(corner) + " in face " + std::to_string(polygon) +
               ", wanted one of " + std::to_string(vertices_.size()) + " vertices");
  }
  if (!vertices_[static_cast<std::size_t>(corner)].allFinite()) {
    file_.fail("got a vertex that is not finite in face " + std::to_string(polygon) + " (vertex " +
               std::to_string(corner) + "), wanted numbers");
  }
}

TriangleFile TriangleSoup::toTriangleFile() {
  std::unordered_map<std::array<double, 3>, int, VertexHash> places;
  std::vector<Eigen::Vector3d> kept, polygon;
  std::vector<Eigen::Vector3i> triangles;
  std::vector<int> names, split;
  const auto index = [](int name) { return static_cast<std::size_t>(name); };
  bool surface = false;
  for (std::size_t f = 0; f < polygons_.size(); ++f) {
    polygon.clear();
    names.clear();
    for (std::size_t c = 0; c < polygons_[f].size; ++c) {
      const std::int64_t corner = corners_[polygons_[f].first + c];
      checkCorner(corner, f);
      const Eigen::Vector3d& v = vertices_[static_cast<std::size_t>(corner)];
      const auto [place, is_new] = places.try_emplace({v.x(), v.y(), v.z()}, static_cast<int>(kept.size()));
      if (is_new) kept.push_back(v);
      polygon.push_back(v);
      names.push_back(place->second);
    }
    if (polygon.size() > kMostConcaveWork) {
      std::vector<int> distinct = names;
      std::sort(distinct.begin(), distinct.end());
      if (std::unique(distinct.begin(), distinct.end()) != distinct.end()) {
        file_.fail("got a polygon of " + std::to_string(polygon.size()) +
                   " corners, some of them equal, in face " + std::to_string(f));
      }
    }
    splitPolygon(polygon, split);
    for (std::size_t n = 0; n < split.size(); n += 3) {
      const auto name = [&](std::size_t c) { return names[static_cast<std::size_t>(split[n + c])]; };
      const Eigen::Vector3i t(name(0), name(1), name(2));
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
      triangles.push_back(t);
      const Eigen::Vector3d a = kept[index(t[0])], u = kept[index(t[1])] - a, v = kept[index(t[2])] - a;
      constexpr double kNoArea = 1e-12;  // of the sides' product: rounding alone makes more
      surface = surface || u.cross(v).norm() > kNoArea * u.norm() * v.norm();
    }
  }
  if (triangles.empty()) {
    file_.fail("got " + std::to_string(vertices_.size()) + " vertices and no triangle, wanted a mesh" +
               (vertices_.empty() ? "" : " (points only? ttsdf_build --cloud makes a map of a point cloud)"));
  }
  if (!surface) {
    file_.fail("got " + std::to_string(triangles.size()) +
               " triangles and none with an area, wanted corners that do not lie on a line");
  }
  TriangleFile result;
  result.vertices.resize(3, static_cast<Eigen::Index>(kept.size()));
  for (std::size_t n = 0; n < kept.size(); ++n) result.vertices.col(static_cast<Eigen::Index>(n)) = kept[n];
  result.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (std::size_t n = 0; n < triangles.size(); ++n)
    result.triangles.col(static_cast<Eigen::Index>(n)) = triangles[n];
  return result;
}

bool isTriangleFile(const std::string& path) {
  const std::string ending = lowerEnding(path);
  return ending == ".ply" || ending == ".off" || ending == ".obj" || ending == ".stl";
}

TriangleFile readTriangles(const std::string& path) {
  const std::string ending = lowerEnding(path);
  const FileBytes file("mesh", path);
  TriangleSoup soup(file);
  if (file.text().line() == "ply") {
    readPlyTriangles(file, soup);
  } else if (ending == ".off") {
    readOffTriangles(file, soup);
  } else if (ending == ".obj") {
    readObjTriangles(file, soup);
  } else if (ending == ".stl") {
    readStlTriangles(file, soup);
  } else if (ending == ".ply") {
    file.fail("got no PLY header, wanted 'ply' in the first line");
  } else {
    file.fail("got ending '" + ending + "', wanted .ply, .off, .obj or .stl");
  }
  return soup.toTriangleFile();
}

}  // namespace ttsdf
