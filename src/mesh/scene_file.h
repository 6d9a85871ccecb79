#pragma once
// Meshes of formats that assimp reads and nothing here does, in a process of their own.

#include <string>

#include "ttsdf_localization/readers/triangle_file.h"

namespace ttsdf {

/// All triangles of all meshes of a scene, the nodes' transforms applied. Single precision: assimp has no
/// other. Throws std::runtime_error naming the file.
TriangleFile readSceneFile(const std::string& path);

}  // namespace ttsdf
