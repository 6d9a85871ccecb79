#pragma once
// Collects what a mesh file says, checks it, and makes triangles of it. One for every format.

#include <string>
#include <vector>

#include "ttsdf_localization/readers/file_bytes.h"
#include "ttsdf_localization/readers/triangle_file.h"

namespace ttsdf {

class TriangleSoup {
 public:
  explicit TriangleSoup(const FileBytes& file) : file_(file) {}

  void addVertex(double x, double y, double z) { vertices_.emplace_back(x, y, z); }
  std::size_t vertexCount() const { return vertices_.size(); }
  /// A polygon; its corners may come before their vertices. Two corners or fewer are no surface and left out.
  void addPolygon(const std::vector<std::int64_t>& corners);
  /// Each corner from the third on makes a triangle with the two before it; -1 begins a new strip.
  void addStrip(const std::vector<std::int64_t>& corners);
  /// Checked, split, equal vertices joined, triangles with equal corners and vertices of no triangle dropped.
  TriangleFile toTriangleFile();

 private:
  struct Polygon {
    std::size_t first, size;
  };
  void checkCorner(std::int64_t corner, std::size_t polygon) const;

  const FileBytes& file_;
  std::vector<Eigen::Vector3d> vertices_;
  std::vector<std::int64_t> corners_;
  std::vector<Polygon> polygons_;
};

void readPlyTriangles(const FileBytes& file, TriangleSoup& soup);
void readOffTriangles(const FileBytes& file, TriangleSoup& soup);
void readObjTriangles(const FileBytes& file, TriangleSoup& soup);
void readStlTriangles(const FileBytes& file, TriangleSoup& soup);

/// Splits a polygon into triangles of its corners: a fan where it is convex, ears elsewhere. `split` receives
/// places in `corners`, three per triangle.
void splitPolygon(const std::vector<Eigen::Vector3d>& corners, std::vector<int>& split);

}  // namespace ttsdf
