#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Exporter.hpp>
#include <assimp/Importer.hpp>
#include <cmath>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf {
namespace {

/// All triangles of all meshes of a scene; assimp has already applied the nodes' transforms.
SurfaceMesh joined(const aiScene& scene, float scale) {
  Eigen::Index vertex_count = 0;
  std::vector<Eigen::Vector3i> triangles;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) vertex_count += scene.mMeshes[m]->mNumVertices;
  SurfaceMesh mesh;
  mesh.vertices.resize(3, vertex_count);
  int first = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& part = *scene.mMeshes[m];
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      const aiVector3D& p = part.mVertices[v];
      mesh.vertices.col(first + static_cast<int>(v)) = scale * Eigen::Vector3f(p.x, p.y, p.z);
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;
      Eigen::Vector3i t;
      for (unsigned c = 0; c < 3; ++c) t[static_cast<int>(c)] = first + static_cast<int>(face.mIndices[c]);
      if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles.push_back(t);
    }
    first += static_cast<int>(part.mNumVertices);
  }
  mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (std::size_t n = 0; n < triangles.size(); ++n)
    mesh.triangles.col(static_cast<Eigen::Index>(n)) = triangles[n];
  return mesh;
}

/// assimp allocates what the header of a .ply or .off promises before it looks at the rest of the file.
void checkCounts(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw std::runtime_error("mesh '" + path + "': cannot be opened");
  const auto size = static_cast<double>(file.tellg());
  file.seekg(0);
  const auto refuse = [&](double count) {
    std::ostringstream text;
    text << "mesh '" << path << "': got a header that promises " << count << " elements in a file of " << size
         << " bytes";
    if (count > size) throw std::runtime_error(text.str());
  };
  std::string line;
  std::getline(file, line);
  if (line.rfind("OFF", 0) == 0) {
    std::string numbers = line.substr(3);
    while (numbers.find_first_of("0123456789") == std::string::npos && std::getline(file, line)) {
      numbers = line.substr(0, line.find('#'));
    }
    std::istringstream counts(numbers);
    for (double count = 0.0; counts >> count;) refuse(count);
  } else if (line.rfind("ply", 0) == 0) {
    while (std::getline(file, line) && line.rfind("end_header", 0) != 0) {
      std::istringstream words(line);
      std::string keyword, name;
      double count = 0.0;
      if (words >> keyword >> name >> count && keyword == "element") refuse(count);
    }
  }
}

/// assimp frees the scene's arrays with the scene.
std::unique_ptr<aiScene> toScene(const SurfaceMesh& mesh) {
  auto scene = std::make_unique<aiScene>();
  scene->mRootNode = new aiNode();
  scene->mRootNode->mNumMeshes = 1;
  scene->mRootNode->mMeshes = new unsigned[1]{0};
  scene->mNumMaterials = 1;
  scene->mMaterials = new aiMaterial* [1] { new aiMaterial() };
  scene->mNumMeshes = 1;
  scene->mMeshes = new aiMesh* [1] { new aiMesh() };
  aiMesh& part = *scene->mMeshes[0];
  part.mPrimitiveTypes = aiPrimitiveType_TRIANGLE;
  part.mNumVertices = static_cast<unsigned>(mesh.vertices.cols());
  part.mVertices = new aiVector3D[part.mNumVertices];
  for (unsigned v = 0; v < part.mNumVertices; ++v) {
    const Eigen::Vector3f p = mesh.vertices.col(static_cast<Eigen::Index>(v));
    part.mVertices[v] = {p.x(), p.y(), p.z()};
  }
  part.mNumFaces = static_cast<unsigned>(mesh.triangles.cols());
  part.mFaces = new aiFace[part.mNumFaces];
  for (unsigned f = 0; f < part.mNumFaces; ++f) {
    aiFace& face = part.mFaces[f];
    face.mNumIndices = 3;
    face.mIndices = new unsigned[3];
    for (int c = 0; c < 3; ++c)
      face.mIndices[c] = static_cast<unsigned>(mesh.triangles(c, static_cast<Eigen::Index>(f)));
  }
  return scene;
}

}  // namespace

void check(const SurfaceMesh& mesh) {
  if (!mesh.vertices.allFinite()) {
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
  checkCounts(path);
  Assimp::Importer importer;
  // Vertices that differ in anything but their place must be joined, too; lines and points are no surface.
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                              aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS | aiComponent_COLORS |
                                  aiComponent_TEXCOORDS | aiComponent_MATERIALS);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* scene =
      importer.ReadFile(path, aiProcess_RemoveComponent | aiProcess_Triangulate | aiProcess_SortByPType |
                                  aiProcess_PreTransformVertices | aiProcess_JoinIdenticalVertices);
  if (!scene) throw std::runtime_error("mesh '" + path + "': " + importer.GetErrorString());
  SurfaceMesh mesh = joined(*scene, static_cast<float>(scale));
  if (mesh.empty()) throw std::runtime_error("mesh '" + path + "': got no triangle, wanted at least one");
  if (!mesh.vertices.allFinite()) {
    throw std::runtime_error("mesh '" + path + "': got a vertex that is not finite, wanted numbers");
  }
  return mesh;
}

void writePly(const SurfaceMesh& mesh, const std::string& path) {
  if (mesh.empty())
    throw std::invalid_argument("mesh '" + path + "': got no triangle to write, wanted at least one");
  check(mesh);
  const auto scene = toScene(mesh);
  Assimp::Exporter exporter;
  if (exporter.Export(scene.get(), "plyb", path) != aiReturn_SUCCESS) {
    throw std::runtime_error("mesh '" + path + "': cannot be written: " + exporter.GetErrorString());
  }
}

}  // namespace ttsdf
