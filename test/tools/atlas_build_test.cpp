// ttsdf_atlas build: who makes the maps changes nothing about them.
#include <cstdlib>

#include "atlas_fixture.h"
#include "ttsdf_localization/atlas/atlas_field.h"

namespace ttsdf {
namespace {

namespace fs = std::filesystem;

/// Every file of an atlas, byte by byte, against those of the one that the fixture made.
void expectSameFiles(const std::string& folder, const std::string& wanted) {
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(wanted)) {
    const std::string name = entry.path().filename();
    EXPECT_EQ(fileText(folder + "/" + name), fileText(entry.path())) << name;
    ++files;
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()),
            static_cast<std::ptrdiff_t>(files));
}

class AtlasBuild : public AtlasTool {
 protected:
  static void expectSame(const std::string& name) { expectSameFiles(*folder_ / name, *folder_ / "atlas"); }
  /// A program in the place of ttsdf_atlas for the tasks.
  static std::string script(const std::string& name, const std::string& text) {
    const std::string path = folder_->write(name, "#!/bin/sh\n" + text);
    fs::permissions(path, fs::perms::owner_all);
    return path;
  }
  static std::string program() { return std::string(TTSDF_TOOL_DIR) + "/ttsdf_atlas"; }
};

TEST_F(AtlasBuild, BuildCutsTheFramesIntoMapsThatOverlap) {
  ASSERT_EQ(first_.exit_code, 0) << first_.err;
  const Atlas atlas = readAtlas(*folder_ / "atlas");
  EXPECT_GT(atlas.maps.size(), 1u);
  for (const auto& list : atlas.neighbours(0.5)) EXPECT_FALSE(list.empty());
  const ToolRun check = run({"check", *folder_ / "atlas"});
  EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
}

TEST_F(AtlasBuild, WorkersDoNotChangeTheResult) {
  ASSERT_EQ(build("again", {"--workers", "2"}).exit_code, 0);
  expectSame("again");
}

// A folder in the place of the last map stops the build when the others are made.
TEST_F(AtlasBuild, ABuildThatWasStoppedGoesOn) {
  const Atlas whole = readAtlas(*folder_ / "atlas");
  ASSERT_GE(whole.maps.size(), 3u);
  const std::string folder = *folder_ / "stopped", state = folder + "/unfinished_build",
                    last = folder + "/" + whole.maps.back().file;
  fs::create_directories(last);
  const ToolRun stopped = build("stopped");
  ASSERT_EQ(stopped.exit_code, 1);
  EXPECT_NE(stopped.err.find(whole.maps.back().file), std::string::npos) << stopped.err;
  ASSERT_TRUE(fs::exists(state));
  EXPECT_FALSE(fs::exists(folder + "/atlas.yaml"));
  fs::remove(last);
  // One file was damaged since, and a result has no end.
  fs::resize_file(folder + "/" + whole.maps[0].file, 100);
  fs::resize_file(state + "/" + whole.maps[1].name + ".result", 12);

  const ToolRun again = build("stopped");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NE(again.out.find(std::to_string(whole.maps.size() - 3) + " of them made by a build before"),
            std::string::npos)
      << again.out;
  for (const AtlasMap& map : whole.maps)
    EXPECT_EQ(fileText(folder + "/" + map.file), fileText(*folder_ / "atlas" + "/" + map.file)) << map.name;
  EXPECT_EQ(fileText(folder + "/atlas.yaml"), fileText(*folder_ / "atlas/atlas.yaml"));
  EXPECT_FALSE(fs::exists(state));
}

TEST_F(AtlasBuild, OtherOptionsTakeNothingFromABuildThatWasStopped) {
  const Atlas whole = readAtlas(*folder_ / "atlas");
  const std::string folder = *folder_ / "other", last = folder + "/" + whole.maps.back().file;
  fs::create_directories(last);
  ASSERT_EQ(build("other").exit_code, 1);
  fs::remove(last);
  const ToolRun again = build("other", {"--min-surface", "0.5"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(again.out.find("made by a build before"), std::string::npos) << again.out;
}

TEST_F(AtlasBuild, AWorkerThatDiesIsTriedAgain) {
  const std::string marks = *folder_ / "marks";
  fs::create_directories(marks);
  const std::string worker = script("dies_once", "[ -e " + marks + "/$3 ] || { : > " + marks +
                                                     "/$3; kill -9 $$; }\nexec " + program() + " \"$@\"\n");
  const ToolRun run = build("dying", {"--worker", worker, "--workers", "2"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  expectSame("dying");
  EXPECT_GE(std::distance(fs::directory_iterator(marks), fs::directory_iterator()),
            static_cast<std::ptrdiff_t>(readAtlas(*folder_ / "atlas").maps.size()));
}

TEST_F(AtlasBuild, AWorkerThatDiesAgainAndAgainStopsTheBuild) {
  const std::string worker = script("dies", "echo no memory is left\nkill -9 $$\n");
  const ToolRun run = build("dead", {"--worker", worker});
  EXPECT_EQ(run.exit_code, 1);
  for (const char* part : {"cell 'x0_y0_z0'", "signal 9", "3 times", "no memory is left"})
    EXPECT_NE(run.err.find(part), std::string::npos) << run.err;
  EXPECT_FALSE(fs::exists(*folder_ / "dead/atlas.yaml"));
}

TEST_F(AtlasBuild, CommandsMakeTheSameAtlas) {
  const std::string list = *folder_ / "tasks.txt", makefile = *folder_ / "tasks.mk";
  const ToolRun run = build("by_hand", {"--commands", list});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("ttsdf_atlas finish"), std::string::npos) << run.out;
  const std::vector<std::string> commands = linesOf(fileText(list));
  ASSERT_GE(commands.size(), 3u);
  // As an array of jobs would: in any order, each in a directory of its own.
  for (std::size_t n = commands.size(); n > 1; --n)
    ASSERT_EQ(std::system(("cd / && " + commands[n - 1]).c_str()), 0) << commands[n - 1];
  const ToolRun early = AtlasTool::run({"finish", *folder_ / "by_hand"});
  EXPECT_EQ(early.exit_code, 1);
  EXPECT_NE(early.err.find("got no result of 1 of"), std::string::npos) << early.err;
  ASSERT_EQ(std::system(commands[0].c_str()), 0);
  ASSERT_EQ(AtlasTool::run({"finish", *folder_ / "by_hand"}).exit_code, 0);
  expectSame("by_hand");

  ASSERT_EQ(build("by_make", {"--commands", makefile}).exit_code, 0);
  ASSERT_EQ(std::system(("make -s -j2 -f " + makefile + " > " + (*folder_ / "make.log")).c_str()), 0)
      << fileText(*folder_ / "make.log");
  expectSame("by_make");
}

// One process holds a cluster of two and runs the build in it.
TEST_F(AtlasBuild, ADaskClusterMakesTheSameAtlas) {
  if (std::system("/usr/bin/python3 -c 'import distributed' 2> /dev/null") != 0)
    GTEST_SKIP() << "python3-distributed is not installed";
  const std::string python = folder_->write(
      "cluster.py",
      "import distributed, subprocess, sys\n"
      "if __name__ == '__main__':\n"
      "    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as "
      "cluster:\n"
      "        address = cluster.scheduler_address\n"
      "        sys.exit(subprocess.run(sys.argv[1:] + ['--scheduler', address]).returncode)\n");
  std::string command = "cd " + (*folder_ / "") + " && /usr/bin/python3 " + python + " " + program();
  for (const std::string& word : arguments("by_dask", {})) command += " '" + word + "'";
  ASSERT_EQ(std::system((command + " > " + (*folder_ / "dask.log") + " 2>&1").c_str()), 0)
      << fileText(*folder_ / "dask.log");
  expectSame("by_dask");
}

TEST_F(AtlasBuild, NoSchedulerIsSaid) {
  const ToolRun run = build("nowhere", {"--scheduler", "tcp://127.0.0.1:1"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("scheduler 'tcp://127.0.0.1:1'"), std::string::npos) << run.err;
  EXPECT_EQ(build("both", {"--scheduler", "x", "--commands", "y"}).exit_code, 2);
}

/// Distance to a block [0, size], positive outside.
double blockSdf(const Eigen::Vector3d& p, const Eigen::Vector3d& size) {
  const Eigen::Array3d q = (p - 0.5 * size).array().abs() - 0.5 * size.array();
  return q.max(0.0).matrix().norm() + std::min(q.maxCoeff(), 0.0);
}

TEST_F(AtlasBuild, AMeshIsCutAsFramesAre) {
  const std::string mesh = folder_->write("block.off",
                                          "OFF\n8 12 0\n"
                                          "0 0 0\n3.1 0 0\n3.1 1.3 0\n0 1.3 0\n"
                                          "0 0 0.9\n3.1 0 0.9\n3.1 1.3 0.9\n0 1.3 0.9\n"
                                          "3 0 2 1\n3 0 3 2\n3 4 5 6\n3 4 6 7\n3 0 1 5\n3 0 5 4\n"
                                          "3 1 2 6\n3 1 6 5\n3 2 3 7\n3 2 7 6\n3 3 0 4\n3 3 4 7\n");
  const std::string folder = *folder_ / "block";
  const ToolRun made =
      AtlasTool::run({"build", folder, "--mesh", mesh, "--voxel-size", "0.05", "--truncation", "0.15",
                      "--size", "1.6", "--overlap", "0.6", "--max-rank", "20"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const Atlas atlas = readAtlas(folder);
  EXPECT_EQ(atlas.maps.size(), 3u);
  std::vector<PlacedField> maps;
  for (const AtlasMap& map : atlas.maps) {
    PlacedField placed;
    placed.name = map.name;
    placed.field = makeField(loadMap(mapPath(folder, map)));
    maps.push_back(placed);
  }
  const AtlasField field(maps);
  const Eigen::Vector3d size(3.1, 1.3, 0.9);
  Eigen::Matrix3Xf points(3, 4000);  // two voxels from the edges, which no map of ranks shows sharp
  int count = 0;
  for (double x = 0.15; x < 2.96; x += 0.11) {
    for (double y = 0.15; y < 1.16; y += 0.11) {
      for (const double z : {0.86, 0.9, 0.95}) points.col(count++) << float(x), float(y), float(z);
    }
  }
  points.conservativeResize(3, count);
  const FieldSamples samples = field.evaluate(points);
  int known = 0;
  for (int n = 0; n < count; ++n) {
    if (samples.states[static_cast<std::size_t>(n)] != PointState::kValid) continue;
    ++known;
    EXPECT_NEAR(samples.values[n], blockSdf(points.col(n).cast<double>(), size), 0.025)
        << points.col(n).transpose();
  }
  EXPECT_GT(known, count * 9 / 10);
}

}  // namespace
}  // namespace ttsdf
