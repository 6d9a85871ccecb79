// ttsdf_atlas build: who makes the maps changes nothing about them.
#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "atlas_fixture.h"
#include "ttsdf_localization/atlas/atlas_field.h"
#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {
namespace {

namespace fs = std::filesystem;

/// Every file of an atlas, byte by byte, against those of the one that the fixture made.
void expectSameFiles(const std::string& folder, const std::string& wanted) {
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(wanted)) {
    const std::string name = entry.path().filename();
    EXPECT_EQ(fileContent(folder + "/" + name), fileContent(entry.path())) << name;
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

TEST_F(AtlasBuild, MapsKeepTheViewpointsOfTheirOwnSurroundings) {
  // Cells of 1.3 m: the camera stands in the middle of the room, far from most of them.
  std::vector<std::string> words = arguments("small_cells", {"--max-rank", "10", "--refine-iterations", "0"});
  *(std::find(words.begin(), words.end(), "--size") + 1) = "1.3";
  *(std::find(words.begin(), words.end(), "--overlap") + 1) = "0.3";
  words.erase(std::find(words.begin(), words.end(), "--max-rank"),
              std::find(words.begin(), words.end(), "--size"));
  const ToolRun made = runProcess("ttsdf_atlas", words);
  ASSERT_EQ(made.exit_code, 0) << made.err;
  std::size_t all = 0, some = 0;
  for (const AtlasMap& entry : readAtlas(*folder_ / "small_cells").maps) {
    const std::string bytes = fileContent(*folder_ / "small_cells" + "/" + entry.file);
    const TtSdfMap map = deserialize(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    ASSERT_TRUE(map.agreement.known());
    for (const ViewpointAgreement& v : map.agreement.viewpoints) {
      // A cell, and the distance that viewpoints count for.
      EXPECT_GT(entry.box().depth(v.viewpoint.position), -(1.3 + map.agreement.viewpoint_distance))
          << entry.name;
    }
    ++(map.agreement.viewpoints.size() < 12 ? some : all);
  }
  EXPECT_GT(some, all) << "of twelve frames each map has all";
}

TEST_F(AtlasBuild, WorkersDoNotChangeTheResult) {
  const ToolRun built = build("again", {"--workers", "2"});
  ASSERT_EQ(built.exit_code, 0) << built.err;
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
    EXPECT_EQ(fileContent(folder + "/" + map.file), fileContent(*folder_ / "atlas" + "/" + map.file))
        << map.name;
  EXPECT_EQ(fileContent(folder + "/atlas.yaml"), fileContent(*folder_ / "atlas/atlas.yaml"));
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

TEST_F(AtlasBuild, AWorkerIsAnyCommandOfAShell) {
  const ToolRun set = build("words", {"--worker", "WORD=1 " + program()});
  ASSERT_EQ(set.exit_code, 0) << set.err;
  expectSame("words");
  const ToolRun elsewhere = build("elsewhere", {"--worker", "cd / && " + program()});
  ASSERT_EQ(elsewhere.exit_code, 0) << elsewhere.err;
  expectSame("elsewhere");
}

TEST_F(AtlasBuild, ACommandThatIsNotThereIsTriedOnce) {
  const ToolRun run = build("no_command", {"--worker", *folder_ / "no_such_program"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("exit code 127 (no such command): "), std::string::npos) << run.err;
  EXPECT_EQ(run.err.find("3 times"), std::string::npos) << run.err;
}

TEST_F(AtlasBuild, WorkersAreWaitedForWhereTheStarterIgnoresThem) {
  std::string command = "trap '' CHLD; timeout 120 " + program();
  for (const std::string& word : arguments("ignored", {})) command += " '" + word + "'";
  const std::string log = *folder_ / "ignored.log";
  ASSERT_EQ(std::system(("bash -c \"" + command + "\" > " + log + " 2>&1").c_str()), 0) << fileContent(log);
  expectSame("ignored");
}

// A worker starts a process of its own; both go with the build.
TEST_F(AtlasBuild, NothingIsLeftOfABuildThatIsKilled) {
  const std::string pid = *folder_ / "left.pid",
                    worker = script("sleeps", "sleep 300 &\necho $! > " + pid + ".new\nmv " + pid + ".new " +
                                                  pid + "\nwait\n");
  std::string command = program();
  for (const std::string& word : arguments("killed", {"--worker", worker})) command += " '" + word + "'";
  const std::string log = *folder_ / "killed.log";
  ASSERT_EQ(
      std::system((command + " > " + log + " 2>&1 & build=$!; for n in $(seq 600); do [ -e " + pid +
                   " ] && break; sleep 0.1; done; kill -9 $build; for n in $(seq 100); do kill -0 $(cat " +
                   pid + ") 2> /dev/null || exit 0; sleep 0.1; done; exit 1")
                      .c_str()),
      0)
      << fileContent(log);
}

TEST_F(AtlasBuild, CommandsMakeTheSameAtlas) {
  const std::string list = *folder_ / "tasks.txt", makefile = *folder_ / "tasks.mk";
  const ToolRun run = build("by_hand", {"--commands", list});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("ttsdf_atlas finish"), std::string::npos) << run.out;
  const std::vector<std::string> commands = linesOf(fileContent(list));
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

  const ToolRun built = build("by_make", {"--commands", makefile});
  ASSERT_EQ(built.exit_code, 0) << built.err;
  ASSERT_EQ(std::system(("make -s -j2 -f " + makefile + " > " + (*folder_ / "make.log")).c_str()), 0)
      << fileContent(*folder_ / "make.log");
  expectSame("by_make");
}

// Rules of make are run again, and what was made stays.
TEST_F(AtlasBuild, ACellThatIsMadeIsNotMadeAgain) {
  const std::string list = *folder_ / "twice.txt", folder = *folder_ / "twice";
  const ToolRun built = build("twice", {"--commands", list});
  ASSERT_EQ(built.exit_code, 0) << built.err;
  const std::string cell = readAtlas(*folder_ / "atlas").maps[0].name, file = folder + "/" + cell + ".ttsdf";
  ASSERT_EQ(run({"cell", folder, cell}).exit_code, 0);
  const auto time = fs::last_write_time(file) - std::chrono::hours(1);
  fs::last_write_time(file, time);
  ASSERT_EQ(run({"cell", folder, cell}).exit_code, 0);
  EXPECT_EQ(fs::last_write_time(file), time);

  const std::string settings = folder + "/unfinished_build/settings.json";
  std::string text = fileContent(settings);
  ASSERT_NE(text.find("min_surface"), std::string::npos) << text;
  const std::size_t begin = text.find('"', text.find(':', text.find("min_surface"))) + 1;
  text.replace(begin, text.find('"', begin) - begin, "much");
  folder_->write("twice/unfinished_build/settings.json", text);
  const ToolRun wrong = run({"cell", folder, cell});
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_NE(wrong.err.find("'min_surface': got 'much', wanted a number"), std::string::npos) << wrong.err;
}

TEST_F(AtlasBuild, AnAtlasThatHasAppearedIsNotWrittenOver) {
  const std::string list = *folder_ / "late.txt", folder = *folder_ / "late";
  const ToolRun built = build("late", {"--commands", list});
  ASSERT_EQ(built.exit_code, 0) << built.err;
  for (const std::string& command : linesOf(fileContent(list))) ASSERT_EQ(std::system(command.c_str()), 0);
  folder_->write("late/atlas.yaml", "atlas: 1\nmaps: []\n");
  const ToolRun finish = run({"finish", folder});
  EXPECT_EQ(finish.exit_code, 1);
  EXPECT_NE(finish.err.find("got a folder with an atlas"), std::string::npos) << finish.err;
  EXPECT_EQ(fileContent(folder + "/atlas.yaml"), "atlas: 1\nmaps: []\n");
}

TEST_F(AtlasBuild, FramesAreReadAsToldAndWarningsNameThisProgram) {
  EXPECT_EQ(build("no_order", {"--quaternions", "xyz"}).exit_code, 2);
  EXPECT_EQ(build("no_grid", {"--grid", "x"}).exit_code, 2);
  fs::copy(*folder_ / "frames", *folder_ / "bad_frames");
  folder_->write("bad_frames/frame-000002.pose.txt", "-inf 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  std::vector<std::string> words = arguments("told", {"--depth-scale", "1000", "--poses", "camera-to-world"});
  words[3] = *folder_ / "bad_frames";
  const ToolRun told = run(words);
  ASSERT_EQ(told.exit_code, 0) << told.err;
  EXPECT_NE(told.err.find("ttsdf_atlas: warning: frame skipped"), std::string::npos) << told.err;
  EXPECT_EQ(told.err.find("ttsdf_build:"), std::string::npos) << told.err;
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
      << fileContent(*folder_ / "dask.log");
  expectSame("by_dask");
}

TEST_F(AtlasBuild, AClusterWithoutWorkersIsSaid) {
  if (std::system("/usr/bin/python3 -c 'import distributed' 2> /dev/null") != 0)
    GTEST_SKIP() << "python3-distributed is not installed";
  const std::string script = std::string(TTSDF_TOOL_DIR) + "/../../../../scripts/atlas_dask";
  if (!fs::exists(script)) GTEST_SKIP() << "the scripts are elsewhere";
  folder_->write("none.json", "[]");
  EXPECT_EQ(std::system(("timeout 20 " + script + " tcp://127.0.0.1:1 " + (*folder_ / "none.json")).c_str()),
            0);
  folder_->write("one.json", R"([{"name": "a", "command": "true"}])");
  const std::string python =
      folder_->write("empty_cluster.py",
                     "import distributed, subprocess, sys\n"
                     "if __name__ == '__main__':\n"
                     "    with distributed.LocalCluster(n_workers=0, dashboard_address=None) as cluster:\n"
                     "        words = [sys.argv[1], cluster.scheduler_address, sys.argv[2], '1']\n"
                     "        sys.exit(subprocess.run(words).returncode)\n");
  const std::string log = *folder_ / "empty.log";
  EXPECT_NE(std::system(("cd " + (*folder_ / "") + " && timeout 60 /usr/bin/python3 " + python + " " +
                         script + " " + (*folder_ / "one.json") + " > " + log + " 2>&1")
                            .c_str()),
            0);
  EXPECT_NE(fileContent(log).find("failed got no worker within 1 s"), std::string::npos) << fileContent(log);
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

// A block of the shape of an L: nothing is in the corner between its arms.
TEST_F(AtlasBuild, EmptyCellsCostNothing) {
  const std::string mesh = folder_->write("l.off",
                                          "OFF\n12 10 0\n"
                                          "0 0 0\n5 0 0\n5 0.6 0\n0.6 0.6 0\n0.6 5 0\n0 5 0\n"
                                          "0 0 0.9\n5 0 0.9\n5 0.6 0.9\n0.6 0.6 0.9\n0.6 5 0.9\n0 5 0.9\n"
                                          "4 0 3 2 1\n4 0 5 4 3\n4 6 7 8 9\n4 6 9 10 11\n"
                                          "4 0 1 7 6\n4 1 2 8 7\n4 2 3 9 8\n4 3 4 10 9\n4 4 5 11 10\n"
                                          "4 5 0 6 11\n");
  const std::string folder = *folder_ / "l", list = *folder_ / "l.txt";
  const ToolRun made = AtlasTool::run({"build", folder, "--mesh", mesh, "--voxel-size", "0.05",
                                       "--truncation", "0.15", "--size", "1.6", "--overlap", "0.5",
                                       "--max-rank", "8", "--min-surface", "0", "--commands", list});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::vector<std::string> commands = linesOf(fileContent(list));
  std::size_t results = 0, parts = 0;
  for (const auto& entry : fs::directory_iterator(folder + "/unfinished_build")) {
    results += entry.path().extension() == ".result" ? 1 : 0;
    parts += entry.path().extension() == ".vdb" ? 1 : 0;
  }
  EXPECT_GE(results, 4u);  // of the empty ones, at once
  EXPECT_EQ(parts, commands.size());
  for (const std::string& command : commands) ASSERT_EQ(std::system(command.c_str()), 0) << command;
  const ToolRun finished = AtlasTool::run({"finish", folder});
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  EXPECT_LE(readAtlas(folder).maps.size(), commands.size());
  EXPECT_EQ(AtlasTool::run({"check", folder}).exit_code, 0);
}

}  // namespace
}  // namespace ttsdf
