// What leaves a map, read back by other programs: PCL, OpenVDB, and the rules of map_server's loader.

#include <gtest/gtest.h>
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

#include "box_exports.h"

namespace ttsdf {
namespace {

TEST_F(ExportTool, SurfacesLieWithinHalfAVoxelOfTheMesh) {
  const std::string map = boxMap();
  for (const char* name : {"s.ply", "s.obj", "s.stl"}) {
    exported({map, "--surface", folder_ / name});
    const Distances found = distancesOf(folder_ / name);
    EXPECT_GT(found.count, 1000) << name;
    EXPECT_LT(found.largest, 0.5 * kVoxel) << name;
  }
}

TEST_F(ExportTool, PlacesOfASurveyStayWhereTheyAre) {
  const Eigen::Vector3d utm(356789.123, 5412345.678, 122.956);
  const std::string map = boxMap(utm);
  exported({map, "--surface", folder_ / "s.ply", "--cloud", folder_ / "c.pcd", "--occupancy", folder_ / "o"});
  EXPECT_LT(distancesOf(folder_ / "s.ply", utm).largest, 0.5 * kVoxel);
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
  const std::string map = boxMap();
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
  const std::string map = boxMap();
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
  mapOf("--vdb", folder_ / "v.vdb", "again");  // and by ourselves
}

TEST_F(ExportTool, ResolutionsThatMakeNoSenseAreRefusedAtOnce) {
  const std::string map = boxMap();
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

TEST_F(ExportTool, FilesAreWholeAndReplaceNothingElse) {
  const std::string map = boxMap();
  const std::string before = fileContent(map), other = folder_.write("other.ttsdf", before);
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
  EXPECT_TRUE(fileContent(map) == before);
  EXPECT_TRUE(fileContent(other) == before);
  exported({map, "--occupancy", folder_ / "a: b's #1"});
  EXPECT_NE(fileContent(folder_ / "a: b's #1.yaml").find("image: 'a: b''s #1.pgm'"), std::string::npos);
}

TEST_F(ExportTool, TwoExportsToOneFileAreRefusedHoweverItIsSpelled) {
  const std::string map = boxMap();
  const std::string before = fileContent(map);
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
  EXPECT_TRUE(fileContent(map) == before);
  exported(
      {map, "--surface", folder_ / "sub/o.ply", "--cloud", folder_ / "o.ply", "--occupancy", folder_ / "o"});
}

/// As map_server's image loader: the yaml's thresholds on (255 - grey) / 255, rows from the top.
TEST_F(ExportTool, OccupancyGridsFollowTheRulesOfMapServer) {
  const std::string map = boxMap();
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
  const std::string map = boxMap();
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
