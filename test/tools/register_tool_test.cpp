// ttsdf_register as users call it.
#include <gtest/gtest.h>

#include "box_room.h"
#include "tool_process.h"
#include "ttsdf_localization/frames/frame_folder.h"
#include "ttsdf_localization/tools/scan_io.h"

namespace ttsdf {
namespace {

class RegisterTool : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    saveMap(roomMap(), *folder_ / "room.ttsdf");
    const auto T_map_sensor = roomSensorPose();
    const auto points = roomScan(T_map_sensor, 1500);
    folder_->write("scan.bin", std::string(reinterpret_cast<const char*>(points.data()), 12 * 1500));
    folder_->write("nan.bin", std::string(12 * 200, '\xff'));
    writePose(*folder_ / "truth.txt", T_map_sensor);
    Eigen::Isometry3d T_prior = T_map_sensor;
    T_prior.translate(Eigen::Vector3d(0.04, -0.05, 0.03));
    T_prior.rotate(Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitZ()));
    writePose(*folder_ / "prior.txt", T_prior);
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  static ToolRun run(const std::string& list, std::vector<std::string> more = {}) {
    folder_->write("list.txt", list);
    std::vector<std::string> arguments{"--map",    *folder_ / "room.ttsdf", "--batch", *folder_ / "list.txt",
                                       "--output", *folder_ / "out.csv"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runProcess("ttsdf_register", arguments);
  }
  static std::vector<std::string> output() { return linesOf(fileContent(*folder_ / "out.csv")); }
  static TempFolder* folder_;
};
TempFolder* RegisterTool::folder_ = nullptr;

TEST_F(RegisterTool, FindsThePoseInEveryModeAndVariant) {
  const std::vector<std::vector<std::string>> variants{
      {}, {"--mode", "search"}, {"--dense"}, {"--repeat", "3"}, {"--method", "gauss_newton"}};
  for (const auto& variant : variants) {
    SCOPED_TRACE(variant.empty() ? "track" : variant.back());
    const auto result = run("scan.bin prior.txt truth.txt\n", variant);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto lines = output();
    ASSERT_EQ(lines.size(), 2u);
    EXPECT_EQ(lines[0], kRegistrationCsvHeader);
    const auto cells = cellsOf(lines[1]);
    ASSERT_EQ(cells.size(), cellsOf(lines[0]).size());
    EXPECT_EQ(cells[0], "scan.bin");
    EXPECT_EQ(cells[1], "prior.txt");
    EXPECT_EQ(cells[2], "1500");
    EXPECT_EQ(cells[3], "1") << lines[1];
    EXPECT_GT(std::stod(cells[8]), 0.0);
    EXPECT_LT(std::stod(cells[16]), 0.01) << lines[1];
    EXPECT_LT(std::stod(cells[17]), 0.01) << lines[1];
    EXPECT_NEAR(std::stod(cells[9]), 0.9, 0.01);
  }
}

TEST_F(RegisterTool, ErrorsAreEmptyWithoutTruth) {
  ASSERT_EQ(run("scan.bin prior.txt\n").exit_code, 0);
  const auto cells = cellsOf(output().at(1));
  EXPECT_EQ(cells[16] + cells[17], "");
}

TEST_F(RegisterTool, ScanWithoutUsablePointsIsARowAndNoFailure) {
  const auto result = run("nan.bin prior.txt truth.txt\nscan.bin prior.txt truth.txt\n");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto cells = cellsOf(output().at(1));
  EXPECT_EQ(cells[2], "0");
  EXPECT_EQ(cells[3], "0");
  EXPECT_EQ(cells[4], "too_few_points");
  EXPECT_EQ(cellsOf(output().at(2))[3], "1");
}

TEST_F(RegisterTool, UncertaintyHasARowPerScan) {
  const std::string path = *folder_ / "uncertainty.csv";
  ASSERT_EQ(run("scan.bin prior.txt\nnan.bin prior.txt\n", {"--uncertainty", path}).exit_code, 0);
  const auto lines = linesOf(fileContent(path));
  ASSERT_EQ(lines.size(), 3u);
  for (const auto& line : lines) EXPECT_EQ(cellsOf(line).size(), 38u) << line;
  EXPECT_EQ(cellsOf(lines[0])[37], "c55");
  EXPECT_EQ(cellsOf(lines[1])[1], "0") << "weak directions of a room";
  EXPECT_GT(std::stod(cellsOf(lines[1])[37]), 0.0);
  EXPECT_EQ(cellsOf(lines[2])[37], "") << "no estimate, no covariance";
  expectError(run("scan.bin prior.txt\n", {"--uncertainty", *folder_ / "absent/file.csv"}), 1,
              {"cannot write"});
}

TEST_F(RegisterTool, UnreadableScanLeavesTheOthersAndEndsInFailure) {
  const auto result = run("absent.pcd prior.txt truth.txt\nscan.bin prior.txt truth.txt\n");
  expectError(result, 1, {"1 of 2", "absent.pcd"});
  EXPECT_EQ(cellsOf(output().at(1))[4], "unreadable");
  EXPECT_EQ(cellsOf(output().at(2))[3], "1");
}

TEST_F(RegisterTool, OptionFileAndFlagsReachTheRegistration) {
  const auto config = folder_->write("options.yaml", "max_iterations: 1\nmethod: gauss_newton\n");
  ASSERT_EQ(run("scan.bin prior.txt\n", {"--config", config}).exit_code, 0);
  EXPECT_LE(std::stoi(cellsOf(output().at(1))[5]), 2);  // one, and its evaluation
  const auto bad = folder_->write("bad.yaml", "max_iteration: 1\n");
  expectError(run("scan.bin prior.txt\n", {"--config", bad}), 2, {"bad.yaml", "max_iteration"});
}

TEST_F(RegisterTool, WrongUsageIsTwo) {
  expectError(runProcess("ttsdf_register", {}), 2, {"--map"});
  expectError(run("scan.bin prior.txt\n", {"--mode", "fast"}), 2, {"fast", "track, search or global"});
  expectError(run("scan.bin prior.txt\n", {"--repeat", "0"}), 2, {"--repeat"});
  expectError(run("scan.bin -\n", {"--mode", "global", "--gravity", "0,0"}), 2, {"--gravity", "3 numbers"});
  expectError(run("scan.bin prior.txt\n", {"--max-iterations", "-5"}), 2, {"max_iterations", "-5"});
}

TEST_F(RegisterTool, FailureIsOneAndSaysWhat) {
  expectError(run("scan.bin\n"), 1, {"line 1", "scan prior [truth]"});
  expectError(run("scan.bin absent.txt\n"), 1, {"absent.txt"});
  folder_->write("nan.txt", "nan 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  expectError(run("scan.bin nan.txt\n"), 1, {"nan.txt"});
}

}  // namespace
}  // namespace ttsdf
