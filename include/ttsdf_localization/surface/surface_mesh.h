#pragma once
// Triangle meshes: where surfaces come from (models) and what surfaces are shown as. No OpenVDB, no assimp
// here.

#include <Eigen/Geometry>
#include <string>

namespace ttsdf {

class TsdfVolume;
struct SampledField;
struct TtSdfMap;

struct SurfaceMesh {
  Eigen::Matrix3Xf vertices;   ///< map frame [m], relative to `origin`
  Eigen::Matrix3Xi triangles;  ///< vertex indices, counter-clockwise seen from free space
  /// Map frame [m]. Not zero where the coordinates are too large for single precision (UTM, ECEF).
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();

  bool empty() const { return triangles.cols() == 0; }
};

/// Throws std::invalid_argument: a vertex that is not finite, an index out of range.
void check(const SurfaceMesh& mesh);

/// Reads .ply, .obj, .off and .stl (readers/triangle_file.h) and, through assimp in a process of its own,
/// .gltf, .glb and what else it knows. Equal vertices are joined, triangles without area dropped, coordinates
/// multiplied by `scale` in double precision and kept relative to an origin where they are far away. Throws
/// std::runtime_error naming the file.
SurfaceMesh readMesh(const std::string& path, double scale = 1.0);

/// Binary .ply, in double precision if the mesh has an origin of its own. Throws std::invalid_argument for an
/// empty mesh, std::runtime_error if it cannot be written.
void writePly(const SurfaceMesh& mesh, const std::string& path);

/// The observed surface of a volume: zero crossings between observed band voxels only, so neither the back of
/// the truncation shell nor the border between free and unknown space shows. Empty if nothing was observed.
SurfaceMesh extractSurface(const TsdfVolume& volume);
/// The zero level of a sampled field where its mask supports it.
SurfaceMesh extractSurface(const SampledField& field);
/// The zero level of a compressed map where its mask supports it. Decompresses the whole array.
SurfaceMesh extractSurface(const TtSdfMap& map);

}  // namespace ttsdf
