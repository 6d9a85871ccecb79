#include "ros/scans/scan_selector.h"

#include <gtest/gtest.h>

#include <vector>

namespace ttsdf {
namespace {

Eigen::Isometry3d at(double x, double yaw = 0.0) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().x() = x;
  T.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return T;
}

std::vector<int> taken(ScanSelector& selector, const std::vector<double>& stamps,
                       double metres_per_second = 0.0) {
  std::vector<int> indices;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (selector.take(stamps[i], at(metres_per_second * stamps[i]))) indices.push_back(static_cast<int>(i));
  }
  return indices;
}

TEST(ScanSelector, TakesEveryScanByDefault) {
  ScanSelector selector;
  EXPECT_EQ(taken(selector, {1.0, 1.0, 2.0}), (std::vector<int>{0, 1, 2}));
}

TEST(ScanSelector, TakesEveryNthStartingWithTheFirst) {
  ScanSelectionOptions options;
  options.every = 3;
  ScanSelector selector(options);
  EXPECT_EQ(taken(selector, {0, 1, 2, 3, 4, 5, 6}), (std::vector<int>{0, 3, 6}));
}

TEST(ScanSelector, KeepsTheInterval) {
  ScanSelectionOptions options;
  options.min_interval = 1.0;
  ScanSelector selector(options);
  EXPECT_EQ(taken(selector, {10.0, 10.5, 11.0, 11.9, 12.25}), (std::vector<int>{0, 2, 4}));
}

TEST(ScanSelector, WaitsForMotion) {
  ScanSelectionOptions options;
  options.min_translation = 0.5;
  ScanSelector selector(options);
  EXPECT_EQ(taken(selector, {0.0, 1.0, 2.0, 3.0, 4.0, 5.0}, 0.25), (std::vector<int>{0, 2, 4}));
}

TEST(ScanSelector, TakesATurnAsMotionToo) {
  ScanSelectionOptions options;
  options.min_translation = 0.5;
  options.min_rotation = 0.2;
  ScanSelector selector(options);
  EXPECT_TRUE(selector.take(0.0, at(0.0, 0.0)));
  EXPECT_FALSE(selector.take(1.0, at(0.1, 0.1)));
  EXPECT_TRUE(selector.take(2.0, at(0.1, 0.25)));
}

TEST(ScanSelector, IgnoresTurnsWhenOnlyTranslationIsAsked) {
  ScanSelectionOptions options;
  options.min_translation = 0.5;
  ScanSelector selector(options);
  EXPECT_TRUE(selector.take(0.0, at(0.0, 0.0)));
  EXPECT_FALSE(selector.take(1.0, at(0.0, 3.0)));
}

TEST(ScanSelector, GoesOnAfterTheClockWasSetBack) {
  ScanSelectionOptions options;
  options.min_interval = 1.0;
  options.min_translation = 0.5;
  ScanSelector selector(options);
  EXPECT_EQ(taken(selector, {100.0, 102.0, 5.0, 5.5, 7.0}, 1.0), (std::vector<int>{0, 1, 2, 4}));
}

TEST(ScanSelector, RefusesOptionsOutOfRange) {
  ScanSelectionOptions options;
  options.every = 0;
  EXPECT_THROW(ScanSelector{options}, std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
