#include "scene_file.h"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "../readers/triangle_soup.h"
#include "ttsdf_localization/readers/child_process.h"
#include "ttsdf_localization/readers/file_bytes.h"

namespace ttsdf {

namespace {

/// Runs in the child: vertices as three doubles each and triangles as three numbers each, behind their
/// counts.
std::string importScene(const std::string& path) {
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* scene =
      importer.ReadFile(path, aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_PreTransformVertices);
  if (!scene) {
    const std::string words = importer.GetErrorString();  // some releases say nothing
    throw std::runtime_error("mesh '" + path + "': assimp cannot read it" +
                             (words.empty() ? "" : ": " + words));
  }
  std::string vertices, triangles;
  std::uint64_t counts[2] = {0, 0};
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& part = *scene->mMeshes[m];
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;
      std::int32_t corners[3];
      for (unsigned c = 0; c < 3; ++c) {
        if (face.mIndices[c] >= part.mNumVertices)
          throw std::runtime_error("mesh '" + path + "': got a vertex index out of range");
        corners[c] = static_cast<std::int32_t>(counts[0] + face.mIndices[c]);
      }
      triangles.append(reinterpret_cast<const char*>(corners), sizeof(corners));
      ++counts[1];
    }
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      const double p[3] = {part.mVertices[v].x, part.mVertices[v].y, part.mVertices[v].z};
      vertices.append(reinterpret_cast<const char*>(p), sizeof(p));
    }
    counts[0] += part.mNumVertices;
  }
  return std::string(reinterpret_cast<const char*>(counts), sizeof(counts)) + vertices + triangles;
}

}  // namespace

TriangleFile readSceneFile(const std::string& path) {
  const FileBytes checked("mesh", path);
  if (!Assimp::Importer().IsExtensionSupported(std::filesystem::path(path).extension().string())) {
    checked.fail("got ending '" + std::filesystem::path(path).extension().string() +
                 "', wanted .ply, .obj, .off, .stl, .gltf or .glb");
  }
  const std::string bytes =
      runInChild("mesh '" + path + "'", limitsForFile(path), [&path] { return importScene(path); });
  std::uint64_t counts[2] = {0, 0};
  if (bytes.size() < sizeof(counts)) checked.fail("cannot be read");
  std::memcpy(counts, bytes.data(), sizeof(counts));
  if (bytes.size() != sizeof(counts) + 24 * counts[0] + 12 * counts[1]) checked.fail("cannot be read");
  TriangleSoup soup(checked);
  const char* next = bytes.data() + sizeof(counts);
  for (std::uint64_t n = 0; n < counts[0]; ++n, next += 24) {
    double p[3];
    std::memcpy(p, next, sizeof(p));
    soup.addVertex(p[0], p[1], p[2]);
  }
  for (std::uint64_t n = 0; n < counts[1]; ++n, next += 12) {
    std::int32_t corners[3];
    std::memcpy(corners, next, sizeof(corners));
    soup.addPolygon({corners[0], corners[1], corners[2]});
  }
  return soup.toTriangleFile();
}

}  // namespace ttsdf
