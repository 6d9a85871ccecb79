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
  Eigen::Matrix3Xf vertices;   ///< map frame [m]
  Eigen::Matrix3Xi triangles;  ///< vertex indices, counter-clockwise seen from free space

  bool empty() const { return triangles.cols() == 0; }
};

/// Throws std::invalid_argument: a vertex that is not finite, an index out of range.
void check(const SurfaceMesh& mesh);

/// Reads .ply, .obj or .off through assimp (any line ending, soups, polygons are split); equal vertices are
/// joined, triangles without area dropped, coordinates multiplied by `scale`. Throws std::runtime_error
/// naming the file: unreadable, no mesh, no triangle, not finite.
SurfaceMesh readMesh(const std::string& path, double scale = 1.0);

/// Binary .ply. Throws std::invalid_argument for an empty mesh, std::runtime_error if it cannot be written.
void writePly(const SurfaceMesh& mesh, const std::string& path);

/// The observed surface of a volume: zero crossings between observed band voxels only, so neither the back of
/// the truncation shell nor the border between free and unknown space shows. Empty if nothing was observed.
SurfaceMesh extractSurface(const TsdfVolume& volume);
/// The zero level of a sampled field where its mask supports it.
SurfaceMesh extractSurface(const SampledField& field);
/// The zero level of a compressed map where its mask supports it. Decompresses the whole array.
SurfaceMesh extractSurface(const TtSdfMap& map);

}  // namespace ttsdf
