#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "gltf_file.h"
#include "scene_file.h"
#include "ttsdf_localization/geometry/local_origin.h"
#include "ttsdf_localization/readers/file_bytes.h"
#include "ttsdf_localization/readers/triangle_file.h"
#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf {

void check(const SurfaceMesh& mesh) {
  if (!mesh.vertices.allFinite() || !mesh.origin.allFinite()) {
    throw std::invalid_argument("surface mesh: got a vertex that is not finite, wanted numbers");
  }
  if (mesh.triangles.size() == 0) return;
  if (mesh.triangles.minCoeff() < 0 || mesh.triangles.maxCoeff() >= mesh.vertices.cols()) {
    std::ostringstream text;
    text << "surface mesh: got vertex indices from " << mesh.triangles.minCoeff() << " to "
         << mesh.triangles.maxCoeff() << ", wanted 0 to " << mesh.vertices.cols() - 1;
    throw std::invalid_argument(text.str());
  }
}

SurfaceMesh readMesh(const std::string& path, double scale) {
  if (!std::isfinite(scale) || scale <= 0.0) {
    throw std::invalid_argument("mesh '" + path + "': got scale " + std::to_string(scale) +
                                ", wanted a positive number");
  }
  const std::string ending = lowerEnding(path);
  TriangleFile file = isTriangleFile(path)                    ? readTriangles(path)
                      : ending == ".gltf" || ending == ".glb" ? readGltf(path)
                                                              : readSceneFile(path);
  file.vertices *= scale;
  SurfaceMesh mesh;
  mesh.origin = localOrigin(file.vertices.rowwise().minCoeff(), file.vertices.rowwise().maxCoeff());
  mesh.vertices = (file.vertices.colwise() - mesh.origin).cast<float>();
  mesh.triangles = std::move(file.triangles);
  if (!mesh.vertices.allFinite()) {
    throw std::runtime_error("mesh '" + path + "': got coordinates that are too large at scale " +
                             std::to_string(scale));
  }
  return mesh;
}

namespace {

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

}  // namespace

void writePly(const SurfaceMesh& mesh, const std::string& path) {
  if (mesh.empty())
    throw std::invalid_argument("mesh '" + path + "': got no triangle to write, wanted at least one");
  check(mesh);
  const bool far = !mesh.origin.isZero();
  std::ostringstream header;
  header << "ply\nformat binary_little_endian 1.0\nelement vertex " << mesh.vertices.cols();
  for (const char axis : {'x', 'y', 'z'}) header << "\nproperty " << (far ? "double " : "float ") << axis;
  header << "\nelement face " << mesh.triangles.cols()
         << "\nproperty list uchar int vertex_indices\nend_header\n";
  std::string bytes = header.str();
  for (Eigen::Index n = 0; n < mesh.vertices.cols(); ++n) {
    const Eigen::Vector3d p = mesh.origin + mesh.vertices.col(n).cast<double>();
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      far ? append(bytes, p[axis]) : append(bytes, mesh.vertices(axis, n));
    }
  }
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
    bytes += '\3';
    for (Eigen::Index c = 0; c < 3; ++c) append(bytes, mesh.triangles(c, n));
  }
  std::ofstream out(path, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!out.flush()) throw std::runtime_error("mesh '" + path + "': cannot be written");
}

}  // namespace ttsdf
