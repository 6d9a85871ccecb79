#include "ttsdf_localization/exports/octomap_import.h"

#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>
#include <octomap/OcTreeStamped.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <vector>

#include "ttsdf_localization/readers/child_process.h"
#include "ttsdf_localization/readers/file_bytes.h"

namespace ttsdf {

namespace {

[[noreturn]] void fail(const std::string& path, const std::string& message) {
  throw std::runtime_error("octomap '" + path + "': " + message);
}

struct Header {
  bool binary = false;  ///< occupied or free, without probabilities
  std::string type;     ///< empty for files of before there was a header
};

/// The ending counts where there is no header, the file's first lines where there is one.
Header readHeader(const FileBytes& file) {
  constexpr std::size_t kLongestHeader = 4096;
  WordCursor text(file.begin(), file.begin() + std::min(file.size(), kLongestHeader));
  const std::string_view first = text.line();
  if (first.rfind("# Octomap OcTree", 0) != 0) return {lowerEnding(file.path()) == ".bt", {}};
  const bool binary = first.find("binary") != std::string_view::npos;
  while (!text.atEnd()) {
    const std::string_view key = text.next();
    if (key == "data") break;
    if (key == "id") return {binary, std::string(text.nextInLine())};
    text.skipLine();
  }
  fail(file.path(), "got a header without the tree's type, wanted a line 'id OcTree'");
}

template <class Tree>
std::string surfaceCells(Tree& tree, const std::string& path) {
  if (tree.size() == 0) fail(path, "got no octree");
  const double resolution = tree.getResolution();
  if (!std::isfinite(resolution) || resolution <= 0.0) fail(path, "got no resolution");
  tree.expand();  // of pruned cells: their faces then are of one size
  std::vector<double> numbers{resolution};
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf) {
    if (!tree.isNodeOccupied(*leaf)) continue;
    const octomap::OcTreeKey key = leaf.getKey();
    double normal[3] = {0.0, 0.0, 0.0};
    for (int n = 0; n < 27; ++n) {
      const int step[3] = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
      octomap::OcTreeKey beside = key;
      for (unsigned axis = 0; axis < 3; ++axis)
        beside[axis] = static_cast<octomap::key_type>(beside[axis] + step[axis]);
      const auto* node = tree.search(beside);
      if (!node || tree.isNodeOccupied(node)) continue;
      const double length = std::sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
      for (int axis = 0; axis < 3; ++axis) normal[axis] += step[axis] / length;
    }
    if (normal[0] == 0.0 && normal[1] == 0.0 && normal[2] == 0.0) continue;
    numbers.insert(numbers.end(), {leaf.getX(), leaf.getY(), leaf.getZ(), normal[0], normal[1], normal[2]});
  }
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(double)};
}

template <class Tree>
std::string readSurfaceCells(const std::string& path, bool binary) {
  if (binary) {
    Tree tree(0.1);
    if (!tree.readBinary(path)) fail(path, "got no octree");
    return surfaceCells(tree, path);
  }
  const std::unique_ptr<octomap::AbstractOcTree> any(octomap::AbstractOcTree::read(path));
  auto* const tree = dynamic_cast<Tree*>(any.get());
  if (!tree) fail(path, "got no octree");
  return surfaceCells(*tree, path);
}

/// Runs in the child: resolution, then x y z nx ny nz per cell, as doubles.
std::string readAnyTree(const FileBytes& file) {
  const auto [binary, type] = readHeader(file);
  // What is besides occupancy in their nodes stands in no binary file.
  if (type.empty() || type == "OcTree" || (binary && (type == "ColorOcTree" || type == "OcTreeStamped")))
    return readSurfaceCells<octomap::OcTree>(file.path(), binary);
  if (type == "ColorOcTree") return readSurfaceCells<octomap::ColorOcTree>(file.path(), binary);
  if (type == "OcTreeStamped") return readSurfaceCells<octomap::OcTreeStamped>(file.path(), binary);
  fail(file.path(), "got a tree of type '" + shown(type) + "', wanted OcTree, ColorOcTree or OcTreeStamped");
}

}  // namespace

OrientedCloud readOctomap(const std::string& path, double* resolution) {
  const FileBytes checked("octomap", path);
  const std::string bytes =
      runInChild("octomap '" + path + "'", limitsForFile(path), [&checked] { return readAnyTree(checked); });
  std::vector<double> numbers(bytes.size() / sizeof(double));
  std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(double));
  if (numbers.size() < 7 || (numbers.size() - 1) % 6 != 0) {
    checked.fail("got no occupied cell beside a free one, wanted a map with a surface");
  }
  if (resolution) *resolution = numbers[0];
  const auto count = static_cast<Eigen::Index>(numbers.size() / 6);
  const Eigen::Map<const Eigen::Matrix<double, 6, Eigen::Dynamic>> rows(numbers.data() + 1, 6, count);
  OrientedCloud cloud;
  cloud.points = rows.topRows<3>();
  cloud.normals = rows.bottomRows<3>().colwise().normalized().cast<float>();
  return cloud;
}

}  // namespace ttsdf
