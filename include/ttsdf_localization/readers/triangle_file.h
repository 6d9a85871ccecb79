#pragma once
// Triangles as mesh files hold them: in double precision, nothing scaled, nothing joined but equal vertices.

#include <Eigen/Core>
#include <string>

namespace ttsdf {

struct TriangleFile {
  Eigen::Matrix3Xd
      vertices;  ///< in the file's units; each belongs to a triangle, no two are equal, all are finite
  Eigen::Matrix3Xi triangles;  ///< three different vertices each
};

/// Reads .ply (faces and triangle strips, ascii and binary), .off, .obj and .stl; what a file is shows by its
/// content where it can. Polygons are split. Throws std::runtime_error naming the file and the place:
/// unreadable, truncated, counts that disagree with the data, indices out of range, vertices that are not
/// finite, no triangle.
TriangleFile readTriangles(const std::string& path);

/// Whether readTriangles knows the file's ending.
bool isTriangleFile(const std::string& path);

}  // namespace ttsdf
