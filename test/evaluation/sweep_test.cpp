#include "ttsdf_localization/evaluation/sweep.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace ttsdf {
namespace {

namespace fs = std::filesystem;

class Sweep : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ =
        fs::temp_directory_path() / ("ttsdf_sweep_" + std::string(test->name()) + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  static std::vector<EvaluationScan> scans(int count) {
    std::vector<EvaluationScan> result;
    for (int n = 0; n < count; ++n) {
      EvaluationScan scan;
      scan.name = "scan" + std::to_string(n);
      scan.index = n;
      Vector6d twist;
      twist << 0.1 * n, 0.2, -0.3, n, 1.0, 2.0;
      scan.T_map_sensor = expSe3(twist);
      result.push_back(scan);
    }
    return result;
  }

  fs::path folder_;
};

// Answers with the truth moved by a known amount, whatever the prior.
class KnownErrorMethod final : public Method {
 public:
  KnownErrorMethod(const Eigen::Isometry3d& T_map_sensor, double translation, double rotation)
      : T_(T_map_sensor) {
    T_.translate(Eigen::Vector3d(0.0, translation, 0.0));
    T_.rotate(Eigen::AngleAxisd(rotation, Eigen::Vector3d::UnitZ()));
  }
  Estimate estimate(const ScanPoints&, const Eigen::Isometry3d&,
                    const std::optional<Eigen::Vector3d>& hint) override {
    ++calls;
    gravity = hint;
    return {T_, true, 3, "converged"};
  }
  std::size_t paperBytes() const override { return 0; }
  int calls = 0;
  std::optional<Eigen::Vector3d> gravity;

 private:
  Eigen::Isometry3d T_;
};

TEST_F(Sweep, MethodThatReturnsThePriorScoresExactlyThePerturbation) {
  SweepLog log(path("log.csv"));
  const auto prior = makePriorMethod();
  runSweep({"data", "prior", std::nullopt, 0.0, 1}, *prior, scans(3), SweepPlan{}, log);
  ASSERT_EQ(log.records().size(), 150u);
  for (const auto& summary : summarize(log.records())) {
    const bool moves = summary.kind == PerturbationKind::kTranslation;
    EXPECT_EQ(summary.runs, 15u);
    EXPECT_NEAR(summary.translation.median, moves ? summary.magnitude : 0.0, 1e-9);
    EXPECT_NEAR(summary.rotation.q3, moves ? 0.0 : summary.magnitude, 1e-7);
    if (moves && summary.magnitude == kSuccessDistance) continue;  // on the threshold, rounding decides
    EXPECT_DOUBLE_EQ(summary.success_rate, moves && summary.magnitude >= kSuccessDistance ? 0.0 : 1.0);
  }
}

TEST_F(Sweep, KnownErrorsComeOut) {
  SweepLog log(path("log.csv"));
  const auto scan = scans(1);
  KnownErrorMethod method(scan[0].T_map_sensor, 0.03, 0.2);
  runSweep({"data", "known", std::nullopt, 0.0, 1}, method, scan, {{0.5}, {}, 2, 1}, log);
  ASSERT_EQ(log.records().size(), 2u);
  EXPECT_NEAR(log.records()[0].translation_error, 0.03, 1e-12);
  EXPECT_NEAR(log.records()[0].rotation_error, 0.2, 1e-12);
  EXPECT_TRUE(log.records()[0].offset.isApprox(Eigen::Vector3d(0.0, 0.03, 0.0), 1e-9));
  EXPECT_TRUE(log.records()[0].success());
  EXPECT_EQ(log.records()[0].reason, "converged");
  EXPECT_FALSE(method.gravity);
}

TEST_F(Sweep, NanPoseIsAFailureAndNotALostRow) {
  SweepLog log(path("log.csv"));
  const auto scan = scans(1);
  KnownErrorMethod method(scan[0].T_map_sensor, std::nan(""), 0.0);
  runSweep({"data", "nan", std::nullopt, 0.0, 1}, method, scan, {{0.5}, {}, 1, 1}, log);
  ASSERT_EQ(log.records().size(), 1u);
  EXPECT_FALSE(log.records()[0].success());
  EXPECT_DOUBLE_EQ(summarize(readSweepLog(path("log.csv")))[0].success_rate, 0.0);
}

TEST_F(Sweep, GravityHintIsTheDownDirectionInTheSensorFrame) {
  SweepLog log(path("log.csv"));
  const auto scan = scans(2);
  KnownErrorMethod method(scan[1].T_map_sensor, 0.0, 0.0);
  const Eigen::Vector3d down(0.0, 1.0, 0.0);
  runSweep({"data", "exact", down, 0.0, 1}, method, {scan[1]}, {{0.5}, {}, 1, 1}, log);
  ASSERT_TRUE(method.gravity);
  EXPECT_NEAR((scan[1].T_map_sensor.linear() * *method.gravity - down).norm(), 0.0, 1e-12);
  runSweep({"data", "noisy", down, 0.1, 1}, method, {scan[1]}, {{0.5}, {}, 1, 1}, log);
  const double tilt = std::acos((scan[1].T_map_sensor.linear() * *method.gravity).dot(down));
  EXPECT_GT(tilt, 1e-4);
  EXPECT_LT(tilt, 0.5);
}

TEST_F(Sweep, InterruptedRunGoesOnWhereItStopped) {
  const auto scan = scans(3);
  KnownErrorMethod method(scan[0].T_map_sensor, 0.0, 0.0);
  const SweepRun run{"data", "m", std::nullopt, 0.0, 1};
  const SweepPlan plan{{0.1}, {0.1}, 2, 1};
  {
    SweepLog log(path("log.csv"));
    runSweep(run, method, scan, plan, log, [](double) { return false; });
    EXPECT_EQ(method.calls, 4);
  }
  std::ofstream(path("log.csv"), std::ios::app) << "data,m,scan1,transl";  // cut off in the middle of a row
  SweepLog log(path("log.csv"));
  EXPECT_EQ(log.records().size(), 4u);
  runSweep(run, method, scan, plan, log);
  EXPECT_EQ(method.calls, 12);
  EXPECT_EQ(log.records().size(), 12u);
  EXPECT_EQ(readSweepLog(path("log.csv")).size(), 12u);
}

TEST_F(Sweep, LogKeepsEveryFigure) {
  SweepRecord record;
  record.dataset = "data";
  record.method = "a method";
  record.scan = "frame.png";
  record.kind = PerturbationKind::kRotation;
  record.magnitude = 0.25;
  record.direction = 4;
  record.translation_error = 0.0123456789;
  record.rotation_error = 1e-7;
  record.accepted = true;
  record.reason = "converged";
  record.iterations = 12;
  record.milliseconds = 3.25;
  record.cpu_milliseconds = 3.125;
  record.offset = {0.01, -0.02, 0.5};
  SweepLog(path("log.csv")).append(record);
  const auto records = readSweepLog(path("log.csv"));
  ASSERT_EQ(records.size(), 1u);
  const SweepRecord& read = records[0];
  EXPECT_EQ(read.dataset + read.method + read.scan + read.reason, "dataa methodframe.pngconverged");
  EXPECT_EQ(read.kind, record.kind);
  EXPECT_DOUBLE_EQ(read.magnitude, record.magnitude);
  EXPECT_EQ(read.direction, 4);
  EXPECT_NEAR(read.translation_error, record.translation_error, 1e-11);
  EXPECT_NEAR(read.rotation_error, record.rotation_error, 1e-16);
  EXPECT_TRUE(read.accepted);
  EXPECT_EQ(read.iterations, 12);
  EXPECT_DOUBLE_EQ(read.milliseconds, 3.25);
  EXPECT_DOUBLE_EQ(read.cpu_milliseconds, 3.125);
  EXPECT_TRUE(read.offset.isApprox(record.offset));
}

TEST_F(Sweep, ForeignLogIsRefused) {
  std::ofstream(path("foreign.csv")) << "a,b,c\n1,2,3\n";
  EXPECT_THROW(readSweepLog(path("foreign.csv")), std::runtime_error);
  SweepLog good(path("good.csv"));
  std::ofstream(path("good.csv"), std::ios::app) << "1,2,3\n";
  EXPECT_THROW(readSweepLog(path("good.csv")), std::runtime_error);
  SweepRecord record;
  record.method = "a,b";
  EXPECT_THROW(good.append(record), std::invalid_argument);
}

TEST(SweepSummary, GroupsInOrderAndCountsSuccess) {
  std::vector<SweepRecord> records;
  for (const char* method : {"z", "a"}) {
    for (const double error : {0.01, 0.02, 0.03, 0.2}) {
      SweepRecord record;
      record.method = method;
      record.magnitude = 0.1;
      record.translation_error = error;
      record.rotation_error = 0.1 * error;
      record.milliseconds = 100.0 * error;
      records.push_back(record);
    }
  }
  const auto summaries = summarize(records);
  ASSERT_EQ(summaries.size(), 2u);
  EXPECT_EQ(summaries[0].method, "z");
  EXPECT_DOUBLE_EQ(summaries[0].success_rate, 0.75);
  EXPECT_DOUBLE_EQ(summaries[0].translation.median, 0.025);
  EXPECT_DOUBLE_EQ(summaries[0].translation_of_successes.median, 0.02);
  EXPECT_DOUBLE_EQ(summaries[0].milliseconds, 2.5);
  const std::string table = toTable(summaries);
  EXPECT_NE(table.find("75.0"), std::string::npos) << table;
  EXPECT_NE(table.find("25.0 (17.5-72.5)"), std::string::npos) << table;
}

// Answers with the truth moved by 2 cm along x, and says that it may be off by 1 cm and 10 mrad.
class BoastfulMethod final : public Method {
 public:
  explicit BoastfulMethod(const Eigen::Isometry3d& T_map_sensor) : T_(T_map_sensor) {
    T_.translation().x() += 0.02;
  }
  Estimate estimate(const ScanPoints&, const Eigen::Isometry3d&,
                    const std::optional<Eigen::Vector3d>&) override {
    return {T_, true, 1, "converged", Matrix6d(1e-4 * Matrix6d::Identity())};
  }
  std::size_t paperBytes() const override { return 0; }

 private:
  Eigen::Isometry3d T_;
};

TEST_F(Sweep, NotesHowFarTheTruthIsUnderTheCovariance) {
  const auto scan = scans(1);
  BoastfulMethod method(scan.front().T_map_sensor);
  SweepLog log(path("log.csv"));
  runSweep({"data", "boastful", std::nullopt, 0.0, 1}, method, scan, {{0.1}, {}, 1, 1}, log);
  ASSERT_EQ(log.records().size(), 1u);
  EXPECT_NEAR(log.records().front().mahalanobis_squared, 4.0, 1e-9);  // (2 cm / 1 cm)^2
  EXPECT_NEAR(readSweepLog(path("log.csv")).front().mahalanobis_squared, 4.0, 1e-6);
}

}  // namespace
}  // namespace ttsdf
