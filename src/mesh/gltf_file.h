#pragma once
// glTF 2.0: triangles of a scene in double precision.

#include <string>

#include "ttsdf_localization/readers/triangle_file.h"

namespace ttsdf {

/// All triangles of a .gltf or .glb file's scene, the nodes' transforms applied. Throws std::runtime_error
/// naming the file.
TriangleFile readGltf(const std::string& path);

}  // namespace ttsdf
