// Octrees that leave a map and come back: read by octomap and by ourselves.

#include <gtest/gtest.h>
#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>
#include <octomap/OcTreeStamped.h>

#include "box_exports.h"

namespace ttsdf {
namespace {

using Octrees = ExportTool;

TEST_F(Octrees, AreReadByOctomapAndByOurselves) {
  const std::string map = boxMap();
  exported({map, "--octomap", folder_ / "t.bt"});
  octomap::OcTree tree(folder_ / "t.bt");
  EXPECT_NEAR(tree.getResolution(), kVoxel, 1e-9);
  std::size_t occupied = 0, free = 0;
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf) {
    if (!tree.isNodeOccupied(*leaf)) {
      ++free;
      EXPECT_GT(distance({leaf.getX(), leaf.getY(), leaf.getZ()}), 0.0);
      continue;
    }
    ++occupied;
    EXPECT_LT(std::abs(distance({leaf.getX(), leaf.getY(), leaf.getZ()})), 1.5 * kVoxel);
  }
  EXPECT_GT(occupied, 1000u);
  EXPECT_GT(free, 0u);

  const std::string again = mapOf("--octomap", folder_ / "t.bt", "again");
  exported({again, "--surface", folder_ / "again.ply"});
  EXPECT_LT(distancesOf(folder_ / "again.ply").mean, kVoxel);  // cells are no finer

  // The other format of octomap, with probabilities: the same cells, the same map.
  ASSERT_TRUE(tree.write(folder_ / "t.ot"));
  EXPECT_EQ(fileContent(mapOf("--octomap", folder_ / "t.ot", "probabilities")), fileContent(again));
}

/// Cells deeper inside the turned box than half their diagonal that a way of 6 neighbours over cells which
/// are not occupied leads to, from a corner outside.
int cellsReachedInside(const octomap::OcTree& tree, double angle) {
  const Eigen::AngleAxisd back(-angle, Eigen::Vector3d::UnitZ());
  const double deep = -0.5 * std::sqrt(3.0) * tree.getResolution();
  const auto key = [&tree](int axis, double x) {
    return static_cast<int>(tree.coordToKey(axis < 2 ? x : 0.6 * x));
  };
  Eigen::Array3i low, count;
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = key(axis, -1.5);
    count[axis] = key(axis, 1.5) - low[axis] + 1;
  }
  std::vector<bool> seen(static_cast<std::size_t>(count.prod()));
  std::vector<Eigen::Array3i> open;
  int reached = 0;
  const auto visit = [&](const Eigen::Array3i& at) {
    if ((at < 0).any() || (at >= count).any()) return;
    const auto n = static_cast<std::size_t>((at.z() * count.y() + at.y()) * count.x() + at.x());
    if (seen[n]) return;
    seen[n] = true;
    octomap::OcTreeKey cell;
    for (int axis = 0; axis < 3; ++axis)
      cell[static_cast<unsigned>(axis)] = static_cast<octomap::key_type>(low[axis] + at[axis]);
    const auto* node = tree.search(cell);
    if (node && tree.isNodeOccupied(node)) return;
    const octomap::point3d p = tree.keyToCoord(cell);
    if (distance(back * Eigen::Vector3d(p.x(), p.y(), p.z())) < deep) ++reached;
    open.push_back(at);
  };
  visit(Eigen::Array3i::Zero());
  EXPECT_EQ(open.size(), 1u) << "the corner outside is occupied";
  while (!open.empty()) {
    const Eigen::Array3i at = open.back();
    open.pop_back();
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        Eigen::Array3i next = at;
        next[axis] += step;
        visit(next);
      }
    }
  }
  return reached;
}

TEST_F(Octrees, HaveNoHolesAtAnyResolution) {
  const double angle = 0.4;
  const std::string map = boxMap(Eigen::Vector3d::Zero(), angle);
  const Eigen::AngleAxisd turn(angle, Eigen::Vector3d::UnitZ());
  for (const double resolution : {0.02, 0.05, 0.07, 0.2}) {
    exported({map, "--octomap", folder_ / "t.bt", "--resolution", std::to_string(resolution)});
    octomap::OcTree tree(folder_ / "t.bt");
    EXPECT_NEAR(tree.getResolution(), resolution, 1e-6);
    EXPECT_EQ(cellsReachedInside(tree, angle), 0) << resolution;
    for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf) {
      const Eigen::Vector3d p = turn.inverse() * Eigen::Vector3d(leaf.getX(), leaf.getY(), leaf.getZ());
      if (tree.isNodeOccupied(*leaf)) {
        EXPECT_LT(std::abs(distance(p)), std::sqrt(3.0) * leaf.getSize());
      }
    }
    // One way through the face x = 1 is found. Two cells wide: cells of a slanting line touch in corners
    // only.
    for (double x = 0.0; x < 1.3; x += 0.2 * resolution) {
      const Eigen::Vector3d p = turn * Eigen::Vector3d(x, 0.1, 0.1);
      for (const double beside : {0.0, resolution}) {
        tree.setNodeValue(octomap::point3d(static_cast<float>(p.x() + beside), static_cast<float>(p.y()),
                                           static_cast<float>(p.z())),
                          -1.0F);
      }
    }
    EXPECT_GT(cellsReachedInside(tree, angle), 0) << resolution;
  }
}

TEST_F(Octrees, OfOtherTypesAreReadOrNamed) {
  octomap::OcTree tree(0.1);
  octomap::ColorOcTree colours(0.1);
  octomap::OcTreeStamped stamped(0.1);
  for (int x = -10; x <= 10; ++x) {
    for (int y = -10; y <= 10; ++y) {
      for (int z = 0; z <= 5; ++z) {
        const octomap::point3d p(0.1F * static_cast<float>(x) + 0.05F, 0.1F * static_cast<float>(y) + 0.05F,
                                 0.1F * static_cast<float>(z) + 0.05F);
        tree.updateNode(p, z == 0);
        colours.updateNode(p, z == 0);
        stamped.updateNode(p, z == 0);
      }
    }
  }
  const auto built = [this](const std::string& file) {
    return runProcess("ttsdf_build", {"--octomap", file, "--voxel-size", "0.1", "--truncation", "0.3",
                                      "--output", folder_ / "m.ttsdf"});
  };
  const auto map = [&](const octomap::AbstractOccupancyOcTree& any, const std::string& name) {
    auto& writable = const_cast<octomap::AbstractOccupancyOcTree&>(any);
    const std::string file = folder_ / name;
    EXPECT_TRUE(name.find("bt") != std::string::npos ? writable.writeBinary(file) : any.write(file));
    const ToolRun run = built(file);
    EXPECT_EQ(run.exit_code, 0) << name << run.err;
    return fileContent(folder_ / "m.ttsdf");
  };
  const std::string plain = map(tree, "plain.bt");
  EXPECT_TRUE(map(tree, "plain.ot") == plain);
  EXPECT_TRUE(map(colours, "colours.bt") == plain);
  EXPECT_TRUE(map(colours, "colours.ot") == plain);
  EXPECT_TRUE(map(stamped, "stamped.ot") == plain);
  // The file's header counts and not its name.
  std::filesystem::rename(folder_ / "plain.ot", folder_ / "full.bt");
  EXPECT_EQ(built(folder_ / "full.bt").exit_code, 0);
  EXPECT_TRUE(fileContent(folder_ / "m.ttsdf") == plain);
  std::string other = fileContent(folder_ / "plain.bt");
  other.replace(other.find("id OcTree"), 9, "id CountingOcTree");
  expectError(built(folder_.write("other.bt", other)), 1, {"other.bt", "CountingOcTree", "wanted OcTree"});
  other.replace(other.find("id CountingOcTree"), 17, "di OcTree");
  expectError(built(folder_.write("none.bt", other)), 1, {"none.bt", "type"});
}

}  // namespace
}  // namespace ttsdf
