#include "ttsdf_localization/exports/octomap_import.h"

#include <octomap/OcTree.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <vector>

#include "ttsdf_localization/readers/child_process.h"
#include "ttsdf_localization/readers/file_bytes.h"

namespace ttsdf {

namespace {

/// Runs in the child: resolution, then x y z nx ny nz per cell, as doubles.
std::string surfaceCells(const std::string& path) {
  const bool binary = std::filesystem::path(path).extension() == ".bt";
  std::unique_ptr<octomap::OcTree> tree;
  if (binary) {
    tree = std::make_unique<octomap::OcTree>(0.1);
    if (!tree->readBinary(path)) tree.reset();
  } else {
    std::unique_ptr<octomap::AbstractOcTree> any(octomap::AbstractOcTree::read(path));
    if (auto* occupancy = dynamic_cast<octomap::OcTree*>(any.get())) {
      tree.reset(occupancy);
      any.release();
    } else if (any) {
      throw std::runtime_error("octomap '" + path + "': got a tree of type " + shown(any->getTreeType()) +
                               ", wanted OcTree");
    }
  }
  if (!tree || tree->size() == 0) throw std::runtime_error("octomap '" + path + "': got no octree");
  const double resolution = tree->getResolution();
  if (!std::isfinite(resolution) || resolution <= 0.0)
    throw std::runtime_error("octomap '" + path + "': got no resolution");
  tree->expand();  // of pruned cells: their faces then are of one size
  std::vector<double> numbers{resolution};
  for (auto leaf = tree->begin_leafs(), end = tree->end_leafs(); leaf != end; ++leaf) {
    if (!tree->isNodeOccupied(*leaf)) continue;
    const octomap::OcTreeKey key = leaf.getKey();
    double normal[3] = {0.0, 0.0, 0.0};
    for (int n = 0; n < 27; ++n) {
      const int step[3] = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
      octomap::OcTreeKey beside = key;
      for (unsigned axis = 0; axis < 3; ++axis)
        beside[axis] = static_cast<octomap::key_type>(beside[axis] + step[axis]);
      const octomap::OcTreeNode* node = tree->search(beside);
      if (!node || tree->isNodeOccupied(node)) continue;
      const double length = std::sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
      for (int axis = 0; axis < 3; ++axis) normal[axis] += step[axis] / length;
    }
    if (normal[0] == 0.0 && normal[1] == 0.0 && normal[2] == 0.0) continue;
    numbers.insert(numbers.end(), {leaf.getX(), leaf.getY(), leaf.getZ(), normal[0], normal[1], normal[2]});
  }
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(double)};
}

}  // namespace

OrientedCloud readOctomap(const std::string& path, double* resolution) {
  const FileBytes checked("octomap", path);
  const std::string bytes =
      runInChild("octomap '" + path + "'", limitsForFile(path), [&path] { return surfaceCells(path); });
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
