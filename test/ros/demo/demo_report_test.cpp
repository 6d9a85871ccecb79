#include "ros/demo/demo_report.h"

#include <gtest/gtest.h>

#include <cmath>

namespace ttsdf {
namespace {

/// A run whose poses are all `error` metres beside the truth.
DemoReport runWithError(double error) {
  DemoReport report;
  report.map_bytes = 100000;
  report.dense_bytes = 50000000;
  report.dims = {500, 400, 150};
  report.ranks = {60, 60};
  report.scans = 100;
  report.localised = 98;
  report.localization_seconds = 10.0;
  for (int i = 0; i < 98; ++i) {
    TimedPose pose;
    pose.stamp = 100.0 + 0.1 * i;
    pose.T_map_sensor.translation() << 0.05 * i, std::sin(0.1 * i), 1.0;
    report.truth.push_back(pose);
    pose.T_map_sensor.translation().z() += error;
    report.estimate.push_back(pose);
  }
  report.registration_ms = {1.0, 2.0, 3.0};
  report.latency_ms = {10.0, 20.0, 30.0};
  return report;
}

TEST(DemoReport, GoodRunHasNoProblems) {
  const DemoReport report = runWithError(0.01);
  EXPECT_TRUE(problems(report).empty());
  const std::string text = toText(report);
  EXPECT_EQ(text.find("FAILED"), std::string::npos);
  EXPECT_NE(text.find("rmse 10.0, median 10.0, max 10.0 mm"), std::string::npos) << text;
  EXPECT_NE(text.find("98 of 100 scans localised (98.0 %), 9.8 scans/s"), std::string::npos) << text;
  EXPECT_NE(text.find("500 x 400 x 150 voxels, ranks 60 60"), std::string::npos) << text;
  EXPECT_NE(text.find("100.0 kB; dense array 50.0 MB (500 times the file)"), std::string::npos) << text;
}

TEST(DemoReport, EachLimitIsAProblemOfItsOwn) {
  EXPECT_EQ(problems(runWithError(0.031)).size(), 1u);
  DemoReport report = runWithError(0.01);
  report.localised = 94;
  ASSERT_EQ(problems(report).size(), 1u);
  EXPECT_NE(toText(report).find("\nFAILED: got poses for 94.0 % of the scans, wanted 95.0 %"),
            std::string::npos);
  report = runWithError(0.01);
  report.map_bytes = 0;
  EXPECT_EQ(problems(report).size(), 1u);
}

TEST(DemoReport, ScansThatASlowMachineDropsAreNamedAndNoProblem) {
  DemoReport report = runWithError(0.01);
  report.scans = 300;
  report.dropped = 200;
  EXPECT_TRUE(problems(report).empty());
  const std::string text = toText(report);
  EXPECT_NE(text.find("98 of 100 scans localised (98.0 %)"), std::string::npos) << text;
  EXPECT_NE(text.find("too slow for every scan: 200 were overtaken"), std::string::npos) << text;
  report.dropped = 400;  // more than there were: no wrap
  EXPECT_EQ(problems(report).size(), 1u);
}

TEST(DemoReport, NothingAtAllIsReportedAndNoCrash) {
  const DemoReport empty;
  EXPECT_EQ(problems(empty).size(), 3u);
  EXPECT_NE(toText(empty).find("FAILED"), std::string::npos);
}

}  // namespace
}  // namespace ttsdf
