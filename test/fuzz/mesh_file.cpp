// Meshes as files: the first byte chooses the ending. Indices of what was read are in range.

#include "files.h"
#include "ttsdf_localization/readers/triangle_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ttsdf::fuzz;
  readAsFile(data, size, kMeshEndings, [](const std::string& path) {
    const ttsdf::TriangleFile mesh = ttsdf::readTriangles(path);
    const bool in_range = mesh.triangles.minCoeff() >= 0 && mesh.triangles.maxCoeff() < mesh.vertices.cols();
    if (!in_range || !mesh.vertices.allFinite()) __builtin_trap();
  });
  return 0;
}
