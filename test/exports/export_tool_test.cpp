// What leaves a map, read back by other programs: PCL, OpenVDB, octomap, and the rules of map_server's
// loader.

#include <gtest/gtest.h>
#include <octomap/OcTree.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "../tools/tool_process.h"
#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf {
namespace {

constexpr double kVoxel = 0.05;
const Eigen::Array3d kHalf(1.0, 0.75, 0.5);

/// Exact signed distance to the box, positive outside.
double distance(const Eigen::Vector3d& p, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
  const Eigen::Array3d q = (p - centre).array().abs() - kHalf;
  return q.max(0.0).matrix().norm() + std::min(0.0, q.maxCoeff());
}

std::string boxObj(const Eigen::Vector3d& centre) {
  std::ostringstream out;
  out.precision(12);
  for (int n = 0; n < 8; ++n) {
    out << "v " << centre.x() + ((n & 4) != 0 ? 1.0 : -1.0) << ' '
        << centre.y() + ((n & 2) != 0 ? 0.75 : -0.75) << ' ' << centre.z() + ((n & 1) != 0 ? 0.5 : -0.5)
        << '\n';
  }
  return out.str() +
         "f 1 2 4\nf 1 4 3\nf 5 7 8\nf 5 8 6\nf 1 5 6\nf 1 6 2\nf 3 4 8\nf 3 8 7\nf 1 3 7\nf 1 7 5\nf 2 6 "
         "8\nf 2 8 4\n";
}

class ExportTool : public ::testing::Test {
 protected:
  std::string build(const std::string& name, const Eigen::Vector3d& centre) {
    const std::string map = folder_ / (name + ".ttsdf");
    const ToolRun run =
        runProcess("ttsdf_build", {"--mesh", folder_.write(name + ".obj", boxObj(centre)), "--voxel-size",
                                   "0.05", "--truncation", "0.15", "--output", map});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return map;
  }
  void exported(std::vector<std::string> arguments) {
    const ToolRun run = runProcess("ttsdf_export", arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }
  TestFolder folder_;
};

TEST_F(ExportTool, SurfacesLieWithinHalfAVoxelOfTheMesh) {
  const std::string map = build("box", Eigen::Vector3d::Zero());
  for (const char* name : {"s.ply", "s.obj", "s.stl"}) {
    exported({map, "--surface", folder_ / name});
    const SurfaceMesh mesh = readMesh(folder_ / name);
    ASSERT_GT(mesh.vertices.cols(), 1000) << name;
    double worst = 0.0;
    for (Eigen::Index n = 0; n < mesh.vertices.cols(); ++n) {
      worst = std::max(worst, std::abs(distance(mesh.vertices.col(n).cast<double>())));
    }
    EXPECT_LT(worst, 0.5 * kVoxel) << name;
  }
}

TEST_F(ExportTool, PlacesOfASurveyStayWhereTheyAre) {
  const Eigen::Vector3d utm(356789.123, 5412345.678, 122.956);
  const std::string map = build("utm", utm);
  exported({map, "--surface", folder_ / "s.ply", "--cloud", folder_ / "c.pcd", "--occupancy", folder_ / "o"});
  const SurfaceMesh mesh = readMesh(folder_ / "s.ply");
  double worst = 0.0;
  for (Eigen::Index n = 0; n < mesh.vertices.cols(); ++n) {
    worst = std::max(worst, std::abs(distance(mesh.origin + mesh.vertices.col(n).cast<double>(), utm)));
  }
  EXPECT_LT(worst, 0.5 * kVoxel);
  const std::string points =
      folder_.write("p.txt", "356789.123 5412345.678 123.656\n356789.123 5412346.628 122.956\n");
  const ToolRun query = runProcess("ttsdf_query", {map, "--points", points});
  double first = 0.0;
  std::istringstream(query.out) >> first;
  EXPECT_NEAR(first, 0.2, 0.01) << query.out;
  EXPECT_NE(runProcess("ttsdf_export", {map, "--surface", folder_ / "s.stl"}).exit_code, 0);
  EXPECT_NE(runProcess("ttsdf_export", {map, "--octomap", folder_ / "s.bt"}).exit_code, 0);
}

TEST_F(ExportTool, CloudsAreReadByPcl) {
  const std::string map = build("box", Eigen::Vector3d::Zero());
  exported({map, "--cloud", folder_ / "c.pcd"});
  pcl::PointCloud<pcl::PointNormal> cloud;
  ASSERT_EQ(pcl::io::loadPCDFile(folder_ / "c.pcd", cloud), 0);
  ASSERT_GT(cloud.size(), 1000u);
  std::size_t outward = 0;
  for (const auto& p : cloud) {
    EXPECT_LT(std::abs(distance(p.getVector3fMap().cast<double>())), 0.5 * kVoxel);
    outward += p.getNormalVector3fMap().dot(p.getVector3fMap()) > 0.0F ? 1 : 0;
  }
  EXPECT_GT(outward, cloud.size() * 99 / 100);  // at the very edges the gradient may point anywhere
}

TEST_F(ExportTool, VolumesAreReadByOpenVdb) {
  const std::string map = build("box", Eigen::Vector3d::Zero());
  exported({map, "--vdb", folder_ / "v.vdb"});
  openvdb::initialize();
  openvdb::io::File file(folder_ / "v.vdb");
  file.open(false);
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("distance"));
  ASSERT_TRUE(grid);
  const openvdb::tools::GridSampler<openvdb::FloatGrid, openvdb::tools::BoxSampler> sampler(*grid);
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(1.1, 0, 0), Eigen::Vector3d(0.96, 0.1, 0.2), Eigen::Vector3d(0, -0.85, 0.1)}) {
    EXPECT_NEAR(static_cast<double>(sampler.wsSample({p.x(), p.y(), p.z()})), distance(p), 0.01)
        << p.transpose();
  }
  // And by ourselves.
  EXPECT_EQ(runProcess("ttsdf_build", {"--vdb", folder_ / "v.vdb", "--voxel-size", "0.05", "--truncation",
                                       "0.15", "--output", folder_ / "again.ttsdf"})
                .exit_code,
            0);
}

TEST_F(ExportTool, OctreesAreReadByOctomapAndByOurselves) {
  const std::string map = build("box", Eigen::Vector3d::Zero());
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

  const ToolRun run =
      runProcess("ttsdf_build", {"--octomap", folder_ / "t.bt", "--voxel-size", "0.05", "--truncation",
                                 "0.15", "--output", folder_ / "again.ttsdf"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  exported({folder_ / "again.ttsdf", "--surface", folder_ / "again.ply"});
  const SurfaceMesh mesh = readMesh(folder_ / "again.ply");
  double sum = 0.0;
  for (Eigen::Index n = 0; n < mesh.vertices.cols(); ++n)
    sum += std::abs(distance(mesh.vertices.col(n).cast<double>()));
  EXPECT_LT(sum / static_cast<double>(mesh.vertices.cols()), kVoxel);  // cells are no finer

  // The other format of octomap, with probabilities: the same cells, the same map.
  ASSERT_TRUE(tree.write(folder_ / "t.ot"));
  ASSERT_EQ(runProcess("ttsdf_build", {"--octomap", folder_ / "t.ot", "--voxel-size", "0.05", "--truncation",
                                       "0.15", "--output", folder_ / "probabilities.ttsdf"})
                .exit_code,
            0);
  EXPECT_EQ(fileText(folder_ / "probabilities.ttsdf"), fileText(folder_ / "again.ttsdf"));
}

/// As map_server's image loader: the yaml's thresholds on (255 - grey) / 255, rows from the top.
TEST_F(ExportTool, OccupancyGridsFollowTheRulesOfMapServer) {
  const std::string map = build("box", Eigen::Vector3d::Zero());
  exported({map, "--occupancy", folder_ / "o", "--min-height", "-0.2", "--max-height", "0.2"});
  std::ifstream yaml(folder_ / "o.yaml");
  double resolution = 0.0, x = 0.0, y = 0.0;
  std::string image;
  for (std::string line; std::getline(yaml, line);) {
    std::replace_if(
        line.begin(), line.end(), [](char c) { return c == '[' || c == ',' || c == ']'; }, ' ');
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "image:") words >> image;
    if (key == "resolution:") words >> resolution;
    if (key == "origin:") words >> x >> y;
  }
  EXPECT_EQ(image, "o.pgm");
  EXPECT_DOUBLE_EQ(resolution, kVoxel);
  std::ifstream pgm(folder_ / image, std::ios::binary);
  std::string magic;
  int width = 0, height = 0, most = 0;
  pgm >> magic >> width >> height >> most;
  pgm.get();
  ASSERT_EQ(magic, "P5");
  std::string pixels(static_cast<std::size_t>(width * height), '\0');
  pgm.read(&pixels[0], width * height);
  ASSERT_TRUE(pgm);
  const auto cell = [&](double px, double py) {
    const int column = static_cast<int>((px - x) / resolution), row = static_cast<int>((py - y) / resolution);
    const double grey =
        static_cast<unsigned char>(pixels[static_cast<std::size_t>((height - 1 - row) * width + column)]);
    const double occupied = (255.0 - grey) / 255.0;
    return occupied > 0.65 ? 100 : occupied < 0.196 ? 0 : -1;
  };
  for (const double side : {-1.0, 1.0}) {
    EXPECT_EQ(cell(side * 1.0, 0.3), 100);
    EXPECT_EQ(cell(0.3, side * 0.75), 100);
    EXPECT_EQ(cell(side * 1.12, 0.1), 0);
    EXPECT_EQ(cell(0.1, side * 0.88), 0);
  }
}

TEST_F(ExportTool, SlicesHoldTheDistances) {
  const std::string map = build("box", Eigen::Vector3d::Zero());
  exported({map, "--slice", folder_ / "s.csv", "--height", "0.1"});
  std::ifstream csv(folder_ / "s.csv");
  std::string line;
  std::getline(csv, line);
  EXPECT_EQ(line, "x,y,distance");
  std::size_t rows = 0;
  while (std::getline(csv, line)) {
    double px = 0.0, py = 0.0, value = 0.0;
    char comma = 0;
    std::istringstream(line) >> px >> comma >> py >> comma >> value;
    const double truth = distance({px, py, 0.1});
    if (std::abs(truth) < 0.05) EXPECT_NEAR(value, truth, 0.02);
    ++rows;
  }
  EXPECT_GT(rows, 1000u);
  expectError(runProcess("ttsdf_export", {map, "--slice", folder_ / "s.csv", "--height", "50"}), 1,
              {"height"});
  expectError(runProcess("ttsdf_export", {map}), 2, {"--surface"});
}

}  // namespace
}  // namespace ttsdf
