// What leaves a map, read back by other programs: PCL, OpenVDB, octomap, and the rules of map_server's
// loader.

#include <gtest/gtest.h>
#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>
#include <octomap/OcTreeStamped.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>
#include <sys/stat.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
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

std::string rotatedBoxObj(double angle) {
  std::istringstream in(boxObj(Eigen::Vector3d::Zero()));
  std::ostringstream out;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string key;
    Eigen::Vector3d p;
    words >> key;
    if (key == "v" && words >> p.x() >> p.y() >> p.z()) {
      out << "v " << (Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) * p).transpose() << '\n';
    } else {
      out << line << '\n';
    }
  }
  return out.str();
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

TEST_F(ExportTool, OctreesHaveNoHolesAtAnyResolution) {
  const double angle = 0.4;
  const std::string map = folder_ / "turned.ttsdf";
  ASSERT_EQ(runProcess("ttsdf_build", {"--mesh", folder_.write("turned.obj", rotatedBoxObj(angle)),
                                       "--voxel-size", "0.05", "--truncation", "0.15", "--output", map})
                .exit_code,
            0);
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

TEST_F(ExportTool, ResolutionsThatMakeNoSenseAreRefusedAtOnce) {
  const std::string map = build("box", Eigen::Vector3d::Zero());
  const auto begin = std::chrono::steady_clock::now();
  for (const char* resolution : {"1e-300", "1e-9", "1e-4", "5", "100", "1e30", "1e308"}) {
    for (const char* what : {"octomap", "occupancy"}) {
      const ToolRun run = runProcess(
          "ttsdf_export", {map, std::string("--") + what, folder_ / "t.bt", "--resolution", resolution});
      expectError(run, 1, {what, "resolution of", "wanted"});
    }
  }
  for (const char* resolution : {"-1", "nan", "inf"}) {
    for (const char* what : {"octomap", "occupancy"}) {
      EXPECT_NE(runProcess("ttsdf_export",
                           {map, std::string("--") + what, folder_ / "t.bt", "--resolution", resolution})
                    .exit_code,
                0)
          << what << resolution;
    }
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(120));
}

TEST_F(ExportTool, OctreesOfOtherTypesAreReadOrNamed) {
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
    return fileText(folder_ / "m.ttsdf");
  };
  const std::string plain = map(tree, "plain.bt");
  EXPECT_TRUE(map(tree, "plain.ot") == plain);
  EXPECT_TRUE(map(colours, "colours.bt") == plain);
  EXPECT_TRUE(map(colours, "colours.ot") == plain);
  EXPECT_TRUE(map(stamped, "stamped.ot") == plain);
  // The file's header counts and not its name.
  std::filesystem::rename(folder_ / "plain.ot", folder_ / "full.bt");
  EXPECT_EQ(built(folder_ / "full.bt").exit_code, 0);
  EXPECT_TRUE(fileText(folder_ / "m.ttsdf") == plain);
  std::string other = fileText(folder_ / "plain.bt");
  other.replace(other.find("id OcTree"), 9, "id CountingOcTree");
  expectError(built(folder_.write("other.bt", other)), 1, {"other.bt", "CountingOcTree", "wanted OcTree"});
  other.replace(other.find("id CountingOcTree"), 17, "di OcTree");
  expectError(built(folder_.write("none.bt", other)), 1, {"none.bt", "type"});
}

TEST_F(ExportTool, FilesAreWholeAndReplaceNothingElse) {
  const std::string map = build("box", Eigen::Vector3d::Zero());
  const std::string before = fileText(map), other = folder_.write("other.ttsdf", before);
  const std::string folder = folder_ / "f.ply";
  std::filesystem::create_directory(folder);
  const std::string pipe = folder_ / "p.ply";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const char* what : {"surface", "cloud", "vdb", "octomap", "slice"}) {
    const std::string flag = std::string("--") + what;
    expectError(runProcess("ttsdf_export", {map, flag, map}), 2, {"MAP.ttsdf", flag});
    expectError(runProcess("ttsdf_export", {map, flag, other}), 1, {"ending '.ttsdf'", "wanted ."});
    expectError(runProcess("ttsdf_export", {map, flag, folder_ / "no_ending"}), 1, {"wanted ."});
    for (const char* ending : {".ply", ".pcd", ".vdb", ".bt", ".csv"})
      EXPECT_NE(runProcess("ttsdf_export", {map, flag, (folder_ / "nowhere/x") + ending}).exit_code, 0);
  }
  expectError(runProcess("ttsdf_export", {map, "--octomap", folder_ / "t.ot"}), 1, {".bt"});
  expectError(runProcess("ttsdf_export", {map, "--surface", folder}), 1, {"f.ply", "folder"});
  expectError(runProcess("ttsdf_export", {map, "--surface", pipe}), 1, {"p.ply", "pipe"});
  EXPECT_TRUE(fileText(map) == before);
  EXPECT_TRUE(fileText(other) == before);
  exported({map, "--occupancy", folder_ / "a: b's #1"});
  EXPECT_NE(fileText(folder_ / "a: b's #1.yaml").find("image: 'a: b''s #1.pgm'"), std::string::npos);
}

TEST_F(ExportTool, TwoExportsToOneFileAreRefusedHoweverItIsSpelled) {
  const std::string map = build("box", Eigen::Vector3d::Zero());
  const std::string before = fileText(map);
  std::filesystem::create_directory(folder_ / "sub");
  std::filesystem::create_symlink(folder_ / "sub", folder_ / "link");
  std::filesystem::create_symlink("sub/new.ply", folder_ / "dangling.ply");
  std::filesystem::create_symlink("box.ttsdf", folder_ / "map.ply");
  const auto refused = [&](std::vector<std::string> flags, const std::vector<std::string>& parts) {
    flags.insert(flags.begin(), map);
    expectError(runProcess("ttsdf_export", flags), 2, parts);
  };
  for (const char* other : {"a.ply", "./a.ply", "sub/../a.ply", "sub//..///a.ply"}) {
    refused({"--surface", folder_ / "a.ply", "--cloud", folder_ / other},
            {"--surface", "--cloud", "wanted a file of its own for each"});
  }
  refused({"--surface", folder_ / "sub/a.ply", "--cloud", folder_ / "link/a.ply"}, {"--surface", "--cloud"});
  refused({"--surface", folder_ / "sub/new.ply", "--cloud", folder_ / "dangling.ply"},
          {"--surface", "--cloud"});
  for (const char* name : {"o", "o.pgm", "o.yaml", "./o"}) {
    refused({"--slice", folder_ / "o.pgm", "--height", "0", "--occupancy", folder_ / name},
            {"--slice", "--occupancy", "o.pgm"});
  }
  refused({"--surface", folder_ / "map.ply"}, {"MAP.ttsdf", "--surface", "map.ply"});
  for (const char* name : {"a.ply", "o.pgm", "o.yaml", "sub/a.ply", "sub/new.ply"})
    EXPECT_FALSE(std::filesystem::exists(folder_ / name)) << name;
  EXPECT_TRUE(fileText(map) == before);
  exported(
      {map, "--surface", folder_ / "sub/o.ply", "--cloud", folder_ / "o.ply", "--occupancy", folder_ / "o"});
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
  ASSERT_EQ(image, "'o.pgm'");
  image = image.substr(1, image.size() - 2);
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
