// From depth frames to a map to a sweep, with the tools alone.
#include <gtest/gtest.h>
#include <json/value.h>

#include <algorithm>

#include "frames_fixture.h"
#include "tool_process.h"
#include "ttsdf_localization/map/map_io.h"
#include "ttsdf_localization/tools/json_file.h"

namespace ttsdf {
namespace {

namespace fs = std::filesystem;

class BuildTool : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    writeFrames(*folder_ / "frames", 24);
    first_ = build("frames", "map.ttsdf", {"--report", *folder_ / "report.json"});
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  static ToolRun build(const std::string& frames, const std::string& map,
                       std::vector<std::string> more = {}) {
    std::vector<std::string> arguments{
        "--frames", *folder_ / frames, "--output", *folder_ / map, "--every", "2", "--voxel-size",
        "0.05",     "--truncation",    "0.15",     "--max-depth",  "5"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runProcess("ttsdf_build", arguments);
  }
  // A copy of the frames to spoil.
  static std::string copyFrames(const std::string& name) {
    fs::copy(*folder_ / "frames", *folder_ / name);
    return *folder_ / name;
  }

  static TempFolder* folder_;
  static ToolRun first_;
};
TempFolder* BuildTool::folder_ = nullptr;
ToolRun BuildTool::first_;

TEST_F(BuildTool, MakesAMapAndAReport) {
  ASSERT_EQ(first_.exit_code, 0) << first_.err;
  const auto map = loadMap(*folder_ / "map.ttsdf");
  EXPECT_NEAR(map.geometry.voxel_size, 0.05, 1e-9);
  EXPECT_NEAR(map.truncation, 0.15, 1e-9);
  EXPECT_LE(map.train.rank1(), 40);
  const auto report = parseJson(fileContent(*folder_ / "report.json"), "report");
  EXPECT_EQ(report["frames_used"].asInt(), 12);
  EXPECT_EQ(report["frames_skipped"].size(), 0u);
  EXPECT_EQ(report["file_bytes"].asUInt64(), fs::file_size(*folder_ / "map.ttsdf"));
  EXPECT_TRUE(report["seconds"].isObject());
  EXPECT_TRUE(first_.err.empty()) << "stderr is no terminal here: no progress on it: " << first_.err;
}

TEST_F(BuildTool, SweepOnTheOtherFramesSucceeds) {
  ASSERT_EQ(first_.exit_code, 0) << first_.err;
  const auto log = *folder_ / "log.csv";
  const std::vector<std::string> arguments{"--map",          *folder_ / "map.ttsdf",
                                           "--frames",       *folder_ / "frames",
                                           "--output",       log,
                                           "--every",        "6",
                                           "--offset",       "1",
                                           "--stride",       "3",
                                           "--max-depth",    "5",
                                           "--map-every",    "2",
                                           "--translations", "0.1",
                                           "--rotations",    "0.05",
                                           "--directions",   "1",
                                           "--methods",      "prior",
                                           "--methods",      "ours=track",
                                           "--methods",      "icp_plane"};
  const auto run = runProcess("ttsdf_evaluate", arguments);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto lines = linesOf(fileContent(log));
  ASSERT_EQ(lines.size(), 1u + 3 * 4 * 2);
  for (const auto& line : lines) {
    const auto cells = cellsOf(line);
    if (cells[0] == "dataset") continue;
    if (cells[1] == "ours") {
      EXPECT_LT(std::stod(cells[6]), 0.03) << line;
    } else if (cells[1] == "icp_plane") {
      EXPECT_LT(std::stod(cells[6]), 0.05) << line;
    } else if (cells[3] == "translation") {
      EXPECT_NEAR(std::stod(cells[6]), 0.1, 1e-6) << line;
    }
  }
  EXPECT_NE(run.out.find("ours"), std::string::npos);
  EXPECT_EQ(runProcess("ttsdf_evaluate", arguments).exit_code, 0);
  EXPECT_EQ(linesOf(fileContent(log)).size(), lines.size()) << "a finished run adds nothing";
}

TEST_F(BuildTool, UnreadableFramesAreSkippedNamedAndCounted) {
  const auto frames = copyFrames("spoilt");
  std::ofstream(frames + "/frame-000002.depth.png") << "no picture";
  std::ofstream(frames + "/frame-000004.pose.txt") << "nan nan nan nan\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  const auto run = build("spoilt", "spoilt.ttsdf", {"--report", *folder_ / "spoilt.json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.err.find("frame-000002"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("frame-000004"), std::string::npos) << run.err;
  const auto report = parseJson(fileContent(*folder_ / "spoilt.json"), "report");
  ASSERT_EQ(report["frames_skipped"].size(), 2u);
  EXPECT_EQ(report["frames_skipped"][0].asString(), "frame-000002.depth.png");
  EXPECT_EQ(report["frames_used"].asInt(), 10);
  EXPECT_EQ(report["skipped"].size(), 2u);
}

TEST_F(BuildTool, FramesOfAnotherSizeAreNamed) {
  const auto frames = copyFrames("odd");
  const std::vector<unsigned short> small(80 * 60, 1000);
  pcl::io::saveShortPNGFile(frames + "/frame-000006.depth.png", small.data(), 80, 60, 1);
  const auto run = build("odd", "odd.ttsdf");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.err.find("frame-000006.depth.png': depth image: got 80 x 60"), std::string::npos) << run.err;
}

TEST_F(BuildTool, FramesWithoutAReadingInRangeSayWhatTheyHold) {
  expectError(build("frames", "x.ttsdf", {"--min-depth", "4.9", "--trust-frames"}), 1,
              {"no surface from", "the median of their readings is", "--max-depth"});
}

TEST_F(BuildTool, UnitsThatCannotBeAreNamed) {
  const auto mesh = [this](const std::string& scale, double at) {
    std::ostringstream text;
    text.precision(12);
    for (const char* p : {"0 0 ", "1 0 ", "0 1 ", "1 1 "}) {
      std::istringstream xy(p);
      double x = 0.0, y = 0.0;
      xy >> x >> y;
      text << "v " << x + at << ' ' << y + at << " 0\n";
    }
    const auto path = folder_->write("plate.obj", text.str() + "f 1 2 4 3\n");
    return runProcess("ttsdf_build", {"--mesh", path, "--scale", scale, "--voxel-size", "0.05",
                                      "--truncation", "0.15", "--output", *folder_ / "plate.ttsdf"});
  };
  expectError(mesh("0.001", 0.0), 1, {"less than one voxel", "--scale"});
  // Whole metres 5000 km away are numbers of single precision, whose steps there are half a metre.
  const auto far = mesh("1", 5412345.0);
  EXPECT_EQ(far.exit_code, 0) << far.err;
  EXPECT_NE(far.err.find("steps of 0.5 m"), std::string::npos) << far.err;
  const auto exact = mesh("1", 5412345.1);
  EXPECT_EQ(exact.exit_code, 0) << exact.err;
  EXPECT_EQ(exact.err.find("steps of"), std::string::npos) << exact.err;
}

TEST_F(BuildTool, FolderWithoutPosesIsAnError) {
  const auto frames = copyFrames("noposes");
  for (const auto& entry : fs::directory_iterator(frames)) {
    if (entry.path().string().find(".pose.txt") != std::string::npos) fs::remove(entry.path());
  }
  expectError(build("noposes", "x.ttsdf"), 1, {"noposes", "pose"});
  EXPECT_FALSE(fs::exists(*folder_ / "x.ttsdf"));
}

TEST_F(BuildTool, FailureLeavesAnOldMapAlone) {
  const std::string old("TTSDF\r\n\x1A old", 12);
  const auto map = folder_->write("old.ttsdf", old);
  expectError(build("absent", "old.ttsdf"), 1, {"absent"});
  EXPECT_EQ(fileContent(map), old);
}

TEST_F(BuildTool, KeepsTheVolumeAndStartsFromIt) {
  const auto vdb = *folder_ / "volume.vdb";
  ASSERT_EQ(build("frames", "kept.ttsdf", {"--save-vdb", vdb}).exit_code, 0);
  const auto run = runProcess("ttsdf_build", {"--vdb", vdb, "--output", *folder_ / "again.ttsdf"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  // The same but for the agreement of its frames, which a volume knows nothing of.
  const TtSdfMap again = loadMap(*folder_ / "again.ttsdf"), kept = loadMap(*folder_ / "kept.ttsdf");
  EXPECT_TRUE(kept.agreement.known());
  EXPECT_FALSE(again.agreement.known());
  const DenseTensor a = full(again.train), b = full(kept.train);
  ASSERT_TRUE((a.dims() == b.dims()).all());
  EXPECT_TRUE(std::equal(a.data(), a.data() + a.dims().prod(), b.data()));
  EXPECT_EQ(again.mask.bits(), kept.mask.bits());
}

TEST_F(BuildTool, WrongUsageIsTwo) {
  const auto out = *folder_ / "x.ttsdf";
  expectError(runProcess("ttsdf_build", {"--output", out}), 2, {"--frames", "--mesh", "--vdb"});
  expectError(runProcess("ttsdf_build", {"--frames", "a", "--vdb", "b", "--output", out}), 2, {"got 2"});
  expectError(runProcess("ttsdf_build", {"--frames", "a"}), 2, {"--output"});
  // Before anything is read: fusion may take hours.
  expectError(runProcess("ttsdf_build", {"--frames", "a", "--output", out, "--max-rank", "4;5"}), 2,
              {"max_rank", "4;5", "R1,R2"});
  expectError(runProcess("ttsdf_build", {"--frames", "a", "--output", out, "--target-bytes", "50000",
                                         "--target-surface-error", "0.01"}),
              2, {"target_bytes", "target_surface_error"});
  expectError(runProcess("ttsdf_build", {"--frames", "a", "--output", out, "--voxel-size", "-1"}), 2,
              {"voxel_size", "-1"});
  expectError(build("frames", "x.ttsdf", {"--offset", "2"}), 2, {"offset"});
  expectError(runProcess("ttsdf_build", {"--frames", "a", "--output", out, "--field", "esdf"}), 2,
              {"esdf", "tsdf"});
}

}  // namespace
}  // namespace ttsdf
