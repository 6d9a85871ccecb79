// glTF as people have it, and as it breaks: the box of 2 x 1.5 x 1 m in buffers, places and instances of all
// kinds.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "../support/temp_folder.h"
#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf {
namespace {

using testing::TempFolder;
using testing::thrownMessage;

const int kFaces[12][3] = {{0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5}, {0, 4, 5}, {0, 5, 1},
                           {2, 3, 7}, {2, 7, 6}, {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

/// 8 positions of floats (96 bytes) and 36 indices of 16 bits (72 bytes).
std::string boxBuffer() {
  std::string bytes;
  for (int n = 0; n < 8; ++n) {
    append(bytes, (n & 4) != 0 ? 1.0F : -1.0F);
    append(bytes, (n & 2) != 0 ? 0.75F : -0.75F);
    append(bytes, (n & 1) != 0 ? 0.5F : -0.5F);
  }
  for (const auto& face : kFaces) {
    for (const int corner : face) append(bytes, static_cast<std::uint16_t>(corner));
  }
  return bytes;
}

std::string base64(const std::string& bytes) {
  static const char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t n = 0; n < bytes.size(); n += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (n + k < bytes.size() ? static_cast<unsigned char>(bytes[n + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      text += n + k <= bytes.size() ? kDigits[bits >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

struct Gltf {
  std::string buffer =
      "{\"byteLength\":168,\"uri\":\"data:application/octet-stream;base64," + base64(boxBuffer()) + "\"}";
  std::string views = "{\"buffer\":0,\"byteLength\":96},{\"buffer\":0,\"byteOffset\":96,\"byteLength\":72}";
  std::string positions = "{\"bufferView\":0,\"componentType\":5126,\"count\":8,\"type\":\"VEC3\"}";
  std::string indices = "{\"bufferView\":1,\"componentType\":5123,\"count\":36,\"type\":\"SCALAR\"}";
  std::string nodes = "{\"mesh\":0}", more, mode = "4";

  std::string text() const {
    return "{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[0]}],\"nodes\":[" + nodes +
           "],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1,\"mode\":" + mode +
           "}]}],\"buffers\":[" + buffer + "],\"bufferViews\":[" + views + "],\"accessors\":[" + positions +
           "," + indices + "]" + more + "}";
  }
};

class GltfFiles : public ::testing::Test {
 protected:
  SurfaceMesh read(const std::string& name, const std::string& content) {
    return readMesh(folder_.write(name, content));
  }
  std::string refusal(const std::string& content, const std::string& name = "a.gltf") {
    const std::string path = folder_.write(name, content);
    const std::string message = thrownMessage<std::runtime_error>([&] { readMesh(path); });
    EXPECT_NE(message.find(path), std::string::npos) << "'" << message << "'";
    return message;
  }
  void expectBox(const SurfaceMesh& mesh, const Eigen::Vector3d& middle,
                 const Eigen::Vector3d& size = {2.0, 1.5, 1.0}) {
    ASSERT_EQ(mesh.triangles.cols(), 12);
    ASSERT_EQ(mesh.vertices.cols(), 8);
    const Eigen::Vector3d low = mesh.origin + mesh.vertices.rowwise().minCoeff().cast<double>(),
                          high = mesh.origin + mesh.vertices.rowwise().maxCoeff().cast<double>();
    EXPECT_LT((0.5 * (low + high) - middle).norm(), 1e-6) << low.transpose() << " to " << high.transpose();
    EXPECT_LT((high - low - size).norm(), 1e-6) << low.transpose() << " to " << high.transpose();
    double volume = 0.0;  // positive where the faces look outwards
    for (Eigen::Index n = 0; n < 12; ++n) {
      Eigen::Matrix3d corners;
      for (int c = 0; c < 3; ++c) corners.col(c) = mesh.vertices.col(mesh.triangles(c, n)).cast<double>();
      volume += corners.determinant() / 6.0;
    }
    EXPECT_NEAR(std::abs(volume), size.prod(), 1e-5 * size.prod());
    volume_ = volume;
  }

  TempFolder folder_;
  double volume_ = 0.0;
};

TEST_F(GltfFiles, BuffersInTheTextBesideItAndInOneFile) {
  Gltf gltf;
  expectBox(read("text.gltf", gltf.text()), {0, 0, 0});
  folder_.write("a box.bin", boxBuffer() + "more");
  gltf.buffer = "{\"byteLength\":168,\"uri\":\"a%20box.bin\"}";
  expectBox(read("beside.gltf", gltf.text()), {0, 0, 0});

  gltf.buffer = "{\"byteLength\":168}";
  std::string json = gltf.text(), glb = "glTF";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  append(glb, std::uint32_t{2});
  append(glb, static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + 168));
  append(glb, static_cast<std::uint32_t>(json.size()));
  glb += "JSON" + json;
  append(glb, std::uint32_t{168});
  glb += std::string("BIN\0", 4) + boxBuffer();
  expectBox(read("one.glb", glb), {0, 0, 0});
  for (std::size_t size = 1; size < glb.size(); size += 17)
    EXPECT_FALSE(refusal(glb.substr(0, size), "cut.glb").empty());
  const std::string text = Gltf().text();
  for (std::size_t size = 1; size < text.size(); size += 17)
    EXPECT_FALSE(refusal(text.substr(0, size)).empty());
}

TEST_F(GltfFiles, NodesMoveTurnAndScale) {
  Gltf gltf;
  gltf.nodes = "{\"translation\":[356789,5412345,100],\"children\":[1]},{\"mesh\":0}";
  expectBox(read("utm.gltf", gltf.text()), {356789, 5412345, 100});
  gltf.nodes = "{\"mesh\":0,\"rotation\":[0,0,0.70710678118,0.70710678118],\"scale\":[2,1,1]}";
  expectBox(read("turned.gltf", gltf.text()), {0, 0, 0}, {1.5, 4.0, 1.0});
  const double outwards = volume_;
  gltf.nodes = "{\"mesh\":0,\"matrix\":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 3,0,1,1]}";
  expectBox(read("mirrored.gltf", gltf.text()), {3, 0, 1});
  EXPECT_GT(volume_ * outwards, 0.0);  // a mirror turns the faces, which must still look the same way
}

TEST_F(GltfFiles, SparsePositions) {
  Gltf gltf;
  // A sparse value moves vertex 7.
  std::string bytes = boxBuffer();
  append(bytes, std::uint32_t{7});
  for (const float x : {5.0F, 0.75F, 0.5F}) append(bytes, x);
  gltf.buffer = "{\"byteLength\":184,\"uri\":\"data:;base64," + base64(bytes) + "\"}";
  gltf.views +=
      ",{\"buffer\":0,\"byteOffset\":168,\"byteLength\":4},{\"buffer\":0,\"byteOffset\":172,\"byteLength\":"
      "12}";
  gltf.positions.replace(gltf.positions.size() - 1, 1,
                         ",\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":2,\"componentType\":5125},"
                         "\"values\":{\"bufferView\":3}}}");
  const SurfaceMesh sparse = read("sparse.gltf", gltf.text());
  EXPECT_EQ(sparse.origin.x() + static_cast<double>(sparse.vertices.row(0).maxCoeff()), 5.0);
  gltf.positions.replace(gltf.positions.find("\"count\":1,"), 10, "\"count\":9,");
  EXPECT_NE(refusal(gltf.text()).find("sparse"), std::string::npos);
}

TEST_F(GltfFiles, WhatDoesNotFitIsRefused) {
  const auto with = [this](auto edit) {
    Gltf gltf;
    edit(gltf);
    return refusal(gltf.text());
  };
  EXPECT_NE(with([](Gltf& g) {
              g.positions.replace(g.positions.find("\"count\":8"), 9, "\"count\":6");
            }).find("vertex index"),
            std::string::npos);
  EXPECT_NE(with([](Gltf& g) {
              g.positions.replace(g.positions.find("\"count\":8"), 9, "\"count\":80");
            }).find("80 values"),
            std::string::npos);
  EXPECT_NE(with([](Gltf& g) { g.positions.replace(g.positions.find("5126"), 4, "5130"); }).find("5130"),
            std::string::npos);
  EXPECT_NE(with([](Gltf& g) { g.indices.replace(g.indices.find("5123"), 4, "5126"); }).find("5126"),
            std::string::npos);
  EXPECT_NE(with([](Gltf& g) { g.indices.replace(g.indices.find("36"), 2, "35"); }).find("multiple of 3"),
            std::string::npos);
  EXPECT_NE(with([](Gltf& g) { g.views.replace(g.views.find("96}"), 3, "96000000}"); }).find("outside"),
            std::string::npos);
  EXPECT_NE(with([](Gltf& g) { g.buffer.replace(g.buffer.find("168"), 3, "1000000000"); }).find("1000000000"),
            std::string::npos);
  EXPECT_NE(
      with([](Gltf& g) { g.buffer = "{\"byteLength\":168,\"uri\":\"absent.bin\"}"; }).find("absent.bin"),
      std::string::npos);
  EXPECT_NE(
      with([](Gltf& g) { g.buffer = "{\"byteLength\":168,\"uri\":\"https://a/b.bin\"}"; }).find("beside"),
      std::string::npos);
  EXPECT_NE(
      with([](Gltf& g) { g.buffer = "{\"byteLength\":168,\"uri\":\"data:;base64,@@\"}"; }).find("base64"),
      std::string::npos);
  EXPECT_NE(with([](Gltf& g) { g.buffer = "{\"byteLength\":168}"; }).find("without its data"),
            std::string::npos);
  EXPECT_NE(with([](Gltf& g) { g.nodes = "{\"mesh\":0,\"children\":[0]}"; }).find("within itself"),
            std::string::npos);
  EXPECT_NE(with([](Gltf& g) { g.nodes = "{\"mesh\":3}"; }).find("number 3 of meshes"), std::string::npos);
  EXPECT_NE(with([](Gltf& g) { g.nodes = "{\"mesh\":-1}"; }).find("whole number"), std::string::npos);
  EXPECT_NE(with([](Gltf& g) { g.nodes = "{\"mesh\":0,\"scale\":[1,1]}"; }).find("'scale'"),
            std::string::npos);
  EXPECT_NE(with([](Gltf& g) { g.mode = "1"; }).find("no triangle"), std::string::npos);
  EXPECT_NE(with([](Gltf& g) {
              g.more = ",\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]";
            }).find("draco"),
            std::string::npos);
  EXPECT_NE(refusal("{\"asset\":{\"version\":\"1.0\"}}").find("wanted 2.0"), std::string::npos);
  EXPECT_NE(refusal("{\"asset\":[]}").find("wanted 2.0"), std::string::npos);
  EXPECT_FALSE(refusal(std::string(5000, '[')).empty());
  // A small file whose nodes hold each other again and again.
  std::string nodes;
  for (int n = 0; n < 40; ++n)
    nodes += "{\"children\":[" + std::to_string(n + 1) + "," + std::to_string(n + 1) + "]},";
  EXPECT_NE(with([&](Gltf& g) { g.nodes = nodes + "{\"mesh\":0}"; }).find("again and again"),
            std::string::npos);
}

}  // namespace
}  // namespace ttsdf
