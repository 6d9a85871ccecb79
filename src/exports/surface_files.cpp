#include <algorithm>
#include <cstdint>
#include <iomanip>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "export_ending.h"
#include "export_file.h"
#include "ttsdf_localization/exports/exports.h"
#include "ttsdf_localization/files/file_writer.h"

namespace ttsdf {

namespace {

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

Eigen::Vector3d vertexOf(const SurfaceMesh& mesh, Eigen::Index n) {
  return mesh.origin + mesh.vertices.col(n).cast<double>();
}

Eigen::Vector3f areaVector(const SurfaceMesh& mesh, Eigen::Index triangle) {
  const Eigen::Vector3f a = mesh.vertices.col(mesh.triangles(0, triangle));
  return (mesh.vertices.col(mesh.triangles(1, triangle)) - a)
      .cross(mesh.vertices.col(mesh.triangles(2, triangle)) - a);
}

std::string objOf(const SurfaceMesh& mesh) {
  std::ostringstream out;
  out << std::setprecision(std::numeric_limits<double>::digits10);
  for (Eigen::Index n = 0; n < mesh.vertices.cols(); ++n)
    out << "v " << vertexOf(mesh, n).transpose() << '\n';
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n)
    out << "f " << (mesh.triangles.col(n).array() + 1).transpose() << '\n';
  return out.str();
}

std::string stlOf(const SurfaceMesh& mesh) {
  std::string bytes(80, ' ');
  append(bytes, static_cast<std::uint32_t>(mesh.triangles.cols()));
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
    const Eigen::Vector3f normal = areaVector(mesh, n).normalized();
    for (Eigen::Index axis = 0; axis < 3; ++axis) append(bytes, normal[axis]);
    for (Eigen::Index c = 0; c < 3; ++c) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) append(bytes, mesh.vertices(axis, mesh.triangles(c, n)));
    }
    append(bytes, std::uint16_t{0});
  }
  return bytes;
}

}  // namespace

void writeSurface(const SurfaceMesh& mesh, const std::string& path) {
  const std::string ending = requireEnding("surface", path, {".ply", ".obj", ".stl"});
  if (mesh.empty()) throw std::invalid_argument("surface '" + path + "': the map shows no surface");
  if (ending == ".ply") {
    FileWriter writer(path);
    writePly(mesh, writer.temporary());
    writer.commit();
  } else if (ending == ".obj") {
    writeExport(path, objOf(mesh));
  } else {
    if (!mesh.origin.isZero()) {
      throw std::invalid_argument("surface '" + path +
                                  "': .stl holds single precision, too little so far from zero; "
                                  "wanted .ply or .obj");
    }
    writeExport(path, stlOf(mesh));
  }
}

void writeSurfaceCloud(const SurfaceMesh& mesh, const std::string& path) {
  const std::string ending = requireEnding("cloud", path, {".pcd", ".ply"});
  if (mesh.empty()) throw std::invalid_argument("cloud '" + path + "': the map shows no surface");
  Eigen::Matrix3Xf normals = Eigen::Matrix3Xf::Zero(3, mesh.vertices.cols());
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
    const Eigen::Vector3f area = areaVector(mesh, n);
    for (Eigen::Index c = 0; c < 3; ++c) normals.col(mesh.triangles(c, n)) += area;
  }
  normals.colwise().normalize();
  const bool far = !mesh.origin.isZero();
  std::ostringstream header;
  if (ending == ".pcd") {
    const char* size = far ? "8" : "4";
    header << "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z normal_x normal_y normal_z\nSIZE " << size << ' '
           << size << ' ' << size << " 4 4 4\nTYPE F F F F F F\nCOUNT 1 1 1 1 1 1\nWIDTH "
           << mesh.vertices.cols() << "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " << mesh.vertices.cols()
           << "\nDATA binary\n";
  } else {
    header << "ply\nformat binary_little_endian 1.0\nelement vertex " << mesh.vertices.cols();
    for (const char* axis : {"x", "y", "z"}) header << "\nproperty " << (far ? "double " : "float ") << axis;
    for (const char* axis : {"nx", "ny", "nz"}) header << "\nproperty float " << axis;
    header << "\nend_header\n";
  }
  std::string bytes = header.str();
  for (Eigen::Index n = 0; n < mesh.vertices.cols(); ++n) {
    const Eigen::Vector3d p = vertexOf(mesh, n);
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      far ? append(bytes, p[axis]) : append(bytes, mesh.vertices(axis, n));
    for (Eigen::Index axis = 0; axis < 3; ++axis) append(bytes, normals(axis, n));
  }
  writeExport(path, bytes);
}

void writeSlice(const TtSdfMap& map, double height, const std::string& path) {
  const std::string ending = requireEnding("slice", path, {".csv", ".pgm"});
  const auto field = makeField(map);
  const GridGeometry& g = map.geometry;
  Eigen::Vector3d low = g.samplePosition(Eigen::Vector3d::Zero()), high = low;
  for (int corner = 1; corner < 8; ++corner) {
    const Eigen::Array3i bits(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    const Eigen::Vector3d p = g.samplePosition((bits * (g.dims - 1)).cast<double>().matrix());
    low = low.cwiseMin(p), high = high.cwiseMax(p);
  }
  if (!(height >= low.z() && height <= high.z())) {
    throw std::invalid_argument("slice '" + path + "': got height " + std::to_string(height) + " m, wanted " +
                                std::to_string(low.z()) + " to " + std::to_string(high.z()) + " m");
  }
  const auto columns = static_cast<Eigen::Index>((high.x() - low.x()) / g.voxel_size) + 1;
  const auto rows = static_cast<Eigen::Index>((high.y() - low.y()) / g.voxel_size) + 1;
  std::ostringstream text;
  text << std::setprecision(9);
  if (ending == ".csv") {
    text << "x,y,distance\n";
  } else {
    text << "P5\n" << columns << ' ' << rows << "\n255\n";
  }
  Eigen::Matrix3Xf points(3, columns);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const double y = ending == ".csv" ? low.y() + static_cast<double>(row) * g.voxel_size
                                      : low.y() + static_cast<double>(rows - 1 - row) * g.voxel_size;
    for (Eigen::Index c = 0; c < columns; ++c) {
      points.col(c) = (Eigen::Vector3d(low.x() + static_cast<double>(c) * g.voxel_size, y, height) -
                       field->geometry().origin)
                          .cast<float>();
    }
    const FieldSamples samples = field->evaluate(points);
    for (Eigen::Index c = 0; c < columns; ++c) {
      const bool valid = samples.states[static_cast<std::size_t>(c)] == PointState::kValid;
      if (ending == ".csv") {
        if (valid)
          text << low.x() + static_cast<double>(c) * g.voxel_size << ',' << y << ',' << samples.values[c]
               << '\n';
        continue;
      }
      constexpr float kRange = 0.2F;  // [m]
      const float share = std::clamp((samples.values[c] + kRange) / (2.0F * kRange), 0.0F, 1.0F);
      text.put(valid ? static_cast<char>(static_cast<unsigned char>(1.0F + 254.0F * share)) : '\0');
    }
  }
  writeExport(path, text.str());
}

}  // namespace ttsdf
