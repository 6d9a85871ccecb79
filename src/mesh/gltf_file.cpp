#include "gltf_file.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <set>
#include <unordered_map>

#include "../readers/triangle_soup.h"
#include "gltf_data.h"
#include "ttsdf_localization/readers/file_bytes.h"

namespace ttsdf {

namespace {

constexpr std::size_t kDeepest = 100;  // of nodes within nodes

class SceneReader {
 public:
  SceneReader(const FileBytes& file, TriangleSoup& soup) : file_(file), data_(file), soup_(soup) {}

  void read() {
    refuseExtensions();
    const Json::Value& scenes = data_.json()["scenes"];
    std::vector<std::size_t> roots;
    if (scenes.isArray() && !scenes.empty()) {
      const Json::Value& scene = data_.item("scenes", data_.number(data_.json(), "scene", 0));
      for (const Json::Value& node : scene["nodes"]) roots.push_back(data_.asNumber(node, "node"));
    } else {
      roots = nodesOfNoOther();
    }
    for (const std::size_t root : roots) visit(root, Eigen::Affine3d::Identity());
  }

 private:
  /// What a reader must know to get the triangles right; looks and lights are none of it.
  void refuseExtensions() const {
    for (const Json::Value& name : data_.json()["extensionsRequired"]) {
      const std::string extension = name.isString() ? name.asString() : "";
      const auto begins = [&extension](const char* start) { return extension.rfind(start, 0) == 0; };
      if (extension == "KHR_mesh_quantization" || begins("KHR_materials") || begins("KHR_texture") ||
          begins("EXT_texture") || begins("KHR_lights"))
        continue;
      file_.fail("needs the extension '" + shown(extension) + "', wanted a glTF without it (uncompressed)");
    }
  }

  std::vector<std::size_t> nodesOfNoOther() const {
    const Json::Value& nodes = data_.json()["nodes"];
    std::set<std::size_t> children;
    for (const Json::Value& node : nodes) {
      if (!node.isObject()) continue;
      for (const Json::Value& child : node["children"]) children.insert(data_.asNumber(child, "node"));
    }
    std::vector<std::size_t> roots;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      if (children.count(n) == 0) roots.push_back(n);
    }
    return roots;
  }

  Eigen::Affine3d transformOf(const Json::Value& node) const {
    Eigen::Affine3d T = Eigen::Affine3d::Identity();
    if (node.isMember("matrix")) {
      const auto m = data_.numbers(node, "matrix", 16, {});
      T.matrix() = Eigen::Map<const Eigen::Matrix4d>(m.data());
      return T;
    }
    const auto t = data_.numbers(node, "translation", 3, {0, 0, 0}),
               s = data_.numbers(node, "scale", 3, {1, 1, 1});
    const auto q = data_.numbers(node, "rotation", 4, {0, 0, 0, 1});
    const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
    if (!(std::abs(rotation.norm() - 1.0) < 0.05)) file_.fail("got a rotation that is no unit quaternion");
    T.translation() = Eigen::Vector3d(t[0], t[1], t[2]);
    T.linear() = rotation.normalized().toRotationMatrix() * Eigen::Vector3d(s[0], s[1], s[2]).asDiagonal();
    return T;
  }

  void visit(std::size_t number, const Eigen::Affine3d& T_scene_parent) {
    if (std::find(path_.begin(), path_.end(), number) != path_.end() || path_.size() >= kDeepest)
      file_.fail("got node " + std::to_string(number) + " within itself, or nodes nested too deep");
    path_.push_back(number);
    const Json::Value& node = data_.item("nodes", number);
    const Eigen::Affine3d T = T_scene_parent * transformOf(node);
    if (node.isMember("mesh")) {
      if (node.isMember("skin"))
        file_.fail("got a mesh that moves with a skeleton, wanted one that stands still");
      const Json::Value& mesh = data_.item("meshes", data_.number(node, "mesh", 0));
      for (const Json::Value& primitive : mesh["primitives"]) addPrimitive(primitive, T);
    }
    countWork(1);
    for (const Json::Value& child : node["children"]) visit(data_.asNumber(child, "node"), T);
    path_.pop_back();
  }

  void addPrimitive(const Json::Value& primitive, const Eigen::Affine3d& T) {
    constexpr std::size_t kTriangles = 4, kStrip = 5, kFan = 6;
    if (!primitive.isObject()) file_.fail("got a primitive that is no object");
    const std::size_t mode = data_.number(primitive, "mode", kTriangles);
    if (mode < kTriangles) return;  // points and lines
    if (mode > kFan) file_.fail("got primitives of mode " + std::to_string(mode) + ", wanted 0 to 6");
    const Json::Value& attributes = primitive["attributes"];
    if (!attributes.isObject() || !attributes.isMember("POSITION"))
      file_.fail("got triangles without POSITION");
    const GltfAccessor positions = data_.positions(data_.number(attributes, "POSITION", 0));
    // Primitives share one buffer, each with a part of its vertices: only those that are used count.
    std::unordered_map<std::size_t, std::int64_t> added;
    const auto addCorner = [&](std::size_t n) {
      const auto [place, is_new] = added.emplace(n, static_cast<std::int64_t>(soup_.vertexCount()));
      if (is_new) {
        countWork(1);
        const double* const v = positions.values.data() + 3 * n;
        const Eigen::Vector3d p = T * Eigen::Vector3d(v[0], v[1], v[2]);
        soup_.addVertex(p.x(), p.y(), p.z());
      }
      return place->second;
    };
    std::vector<std::int64_t> corners;
    if (primitive.isMember("indices")) {
      const GltfAccessor indices = data_.indices(data_.number(primitive, "indices", 0));
      countWork(indices.count);
      for (const double index : indices.values) corners.push_back(addCorner(inMesh(index, positions.count)));
    } else {
      for (std::size_t n = 0; n < positions.count; ++n) corners.push_back(addCorner(n));
    }
    if (mode == kTriangles && corners.size() % 3 != 0)
      file_.fail("got " + std::to_string(corners.size()) + " corners of triangles, wanted a multiple of 3");
    const bool mirrored = T.linear().determinant() < 0.0;
    for (std::size_t n = 2; n < corners.size(); n += mode == kTriangles ? 3 : 1) {
      const bool turned = mirrored != (mode == kStrip && n % 2 == 1);
      const std::int64_t a = corners[mode == kFan ? 0 : n - 2];
      soup_.addPolygon(turned ? std::vector<std::int64_t>{a, corners[n], corners[n - 1]}
                              : std::vector<std::int64_t>{a, corners[n - 1], corners[n]});
    }
  }

  std::size_t inMesh(double index, std::size_t count) const {
    if (index >= static_cast<double>(count)) {
      file_.fail("got vertex index " + std::to_string(static_cast<long long>(index)) + ", wanted one of " +
                 std::to_string(count) + " vertices");
    }
    return static_cast<std::size_t>(index);
  }

  /// One mesh may stand in many places, but a small file must not fill the memory.
  void countWork(std::size_t work) {
    constexpr std::size_t kAlways = 1000000, kPerByte = 16;
    work_ += work;
    if (work_ > std::max(kAlways, kPerByte * data_.bytesRead()))
      file_.fail("got the same parts again and again, more than " + std::to_string(work_) +
                 " vertices in all");
  }

  const FileBytes& file_;
  GltfData data_;
  TriangleSoup& soup_;
  std::vector<std::size_t> path_;
  std::size_t work_ = 0;
};

}  // namespace

TriangleFile readGltf(const std::string& path) {
  const FileBytes file("mesh", path);
  TriangleSoup soup(file);
  try {
    SceneReader(file, soup).read();
  } catch (const Json::Exception& error) {
    file.fail(std::string("is no glTF: ") + shown(error.what()));
  }
  return soup.toTriangleFile();
}

}  // namespace ttsdf
