// ttsdf_info and ttsdf_query as users call them.
#include <gtest/gtest.h>
#include <json/value.h>

#include "box_room.h"
#include "tool_process.h"
#include "ttsdf_localization/tools/json_file.h"

namespace ttsdf {
namespace {

class MapTools : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    saveMap(roomMap(), path());
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  static std::string path() { return *folder_ / "room.ttsdf"; }
  static TempFolder* folder_;
};
TempFolder* MapTools::folder_ = nullptr;

TEST_F(MapTools, EveryToolExplainsItself) {
  for (const char* tool :
       {"ttsdf_build", "ttsdf_info", "ttsdf_query", "ttsdf_register", "ttsdf_convert", "ttsdf_evaluate"}) {
    const auto run = runProcess(tool, {"--help"});
    EXPECT_EQ(run.exit_code, 0) << tool << run.err;
    EXPECT_EQ(run.out.rfind(std::string("usage: ") + tool, 0), 0u) << run.out;
    EXPECT_TRUE(run.err.empty()) << run.err;
    expectError(runProcess(tool, {"--no-such-flag"}), 2, {tool, "no-such-flag"});
  }
}

TEST_F(MapTools, InfoPrintsTheAgreedKeys) {
  const auto run = runProcess("ttsdf_info", {path(), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto info = parseJson(run.out, "output");
  const auto map = loadMap(path());
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(info["dims"][axis].asInt(), map.geometry.dims[axis]);
    EXPECT_NEAR(info["origin"][axis].asDouble(), -0.2, 1e-9);
  }
  EXPECT_EQ(info["ranks"][0].asInt(), map.train.rank1());
  EXPECT_EQ(info["ranks"][1].asInt(), map.train.rank2());
  EXPECT_NEAR(info["voxel_size"].asDouble(), 0.05, 1e-9);
  EXPECT_EQ(info["field"].asString(), "sdf");
  EXPECT_NEAR(info["truncation"].asDouble(), 0.15, 1e-9);
  EXPECT_EQ(info["encoding"].asString(), "float32");
  EXPECT_EQ(info["file_bytes"].asUInt64(), std::filesystem::file_size(path()));
  EXPECT_GT(info["memory_bytes"].asUInt64(), 0u);
  EXPECT_LT(info["memory_bytes"].asUInt64(), 3000000u);  // the default bound on everything a map takes
  EXPECT_EQ(info["dense_bytes"].asUInt64(), 68u * 48u * 56u * 4u);
  EXPECT_EQ(info["map_id"].asString().size(), 8u);
  EXPECT_TRUE(info["build_report"].isObject());
}

TEST_F(MapTools, InfoPrintsLinesForPeople) {
  const auto run = runProcess("ttsdf_info", {path()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("dims: 68 48 56\n"), std::string::npos) << run.out;
}

TEST_F(MapTools, QueryAnswersEveryPointInOrder) {
  const auto points = folder_->write("points.txt", "# x y z\n1.5 1.0 2.0\n9 9 9\n0.5 0.1 1.2\n");
  const auto run = runProcess("ttsdf_query", {path(), "--points", points});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto lines = linesOf(run.out);
  ASSERT_EQ(lines.size(), 3u);
  std::istringstream inside(lines[0]), outside(lines[1]), wall(lines[2]);
  double value = 0, gx = 0, gy = 0, gz = 0;
  int valid = -1;
  ASSERT_TRUE(inside >> value >> gx >> gy >> gz >> valid);
  EXPECT_NEAR(value, 0.4, 1e-3);  // the ceiling at z = 2.4
  EXPECT_NEAR(gz, -1.0, 1e-2);
  EXPECT_EQ(valid, 1);
  ASSERT_TRUE(outside >> value >> gx >> gy >> gz >> valid);
  EXPECT_EQ(valid, 0);
  ASSERT_TRUE(wall >> value >> gx >> gy >> gz >> valid);
  EXPECT_NEAR(value, 0.1, 1e-3);  // the wall y = 0
  EXPECT_NEAR(gy, 1.0, 1e-2);
}

TEST_F(MapTools, QueryNearestTakesTheVoxelsValue) {
  const auto points = folder_->write("points.txt", "1.5 1.0 2.02\n");
  const auto nearest = runProcess("ttsdf_query", {path(), "--points", points, "--interpolation", "nearest"});
  ASSERT_EQ(nearest.exit_code, 0) << nearest.err;
  EXPECT_NEAR(std::stod(nearest.out), 0.4, 1e-3);  // sample at z = 2.0
  const auto trilinear = runProcess("ttsdf_query", {path(), "--points", points});
  EXPECT_NEAR(std::stod(trilinear.out), 0.38, 1e-3);
}

TEST_F(MapTools, ConvertLowersRanksCutsAndJoins) {
  const auto out = *folder_ / "out.ttsdf";
  auto run =
      runProcess("ttsdf_convert", {path(), "--output", out, "--max-rank", "12,9", "--encoding", "float16"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto bytes = readFile(out);
  EXPECT_EQ(fileInfo(bytes.data(), bytes.size()).encoding, Encoding::kFloat16);
  const auto low = deserialize(bytes.data(), bytes.size());
  EXPECT_EQ(low.train.rank1(), 12);
  EXPECT_EQ(low.train.rank2(), 9);
  const auto left = *folder_ / "left.ttsdf", right = *folder_ / "right.ttsdf";
  run = runProcess("ttsdf_convert", {path(), "--output", left, "--crop", "-1,-1,-1,1.6,9,9"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  run = runProcess("ttsdf_convert", {path(), "--output", right, "--crop", "1.4,-1,-1,9,9,9"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_LT(loadMap(left).geometry.dims[0], 45);
  run = runProcess("ttsdf_convert", {left, "--merge", right, "--output", out});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE((loadMap(out).geometry.dims == loadMap(path()).geometry.dims).all());
  expectError(runProcess("ttsdf_convert", {path()}), 2, {"--output"});
  expectError(runProcess("ttsdf_convert", {path(), "--output", out, "--max-rank", "x"}), 2,
              {"--max-rank", "x"});
  expectError(runProcess("ttsdf_convert", {path(), "--output", out, "--crop", "8,8,8,9,9,9"}), 1, {"crop"});
}

TEST_F(MapTools, WrongUsageIsTwoAndFailureIsOne) {
  expectError(runProcess("ttsdf_info", {}), 2, {"MAP.ttsdf"});
  expectError(runProcess("ttsdf_query", {path()}), 2, {"--points"});
  expectError(runProcess("ttsdf_query", {path(), "--points", "x", "--interpolation", "cubic"}), 2, {"cubic"});
  expectError(runProcess("ttsdf_info", {*folder_ / "absent.ttsdf"}), 1, {"absent.ttsdf"});
  expectError(runProcess("ttsdf_query", {path(), "--points", *folder_ / "absent.txt"}), 1, {"absent.txt"});
  const auto bad = folder_->write("bad.txt", "1 2 3\n1 2\n");
  expectError(runProcess("ttsdf_query", {path(), "--points", bad}), 1, {"bad.txt", "line 2", "x y z"});
  const auto foreign = folder_->write("foreign.ttsdf", "this is no map at all, but long enough to look at\n");
  expectError(runProcess("ttsdf_info", {foreign}), 1, {"got"});
  const auto bytes = fileContent(path());
  const auto cut = folder_->write("cut.ttsdf", bytes.substr(0, bytes.size() / 2));
  expectError(runProcess("ttsdf_query", {cut, "--points", bad}), 1, {"got"});
}

}  // namespace
}  // namespace ttsdf
