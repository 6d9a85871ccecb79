#include "ros/scans/clock_watch.h"

#include <gtest/gtest.h>

namespace ttsdf {
namespace {

TEST(ClockWatch, NoticesAClockSetBack) {
  ClockWatch watch;
  EXPECT_FALSE(watch.clockJumpedBack(ros::Time(100.0)));
  EXPECT_FALSE(watch.clockJumpedBack(ros::Time(101.0)));
  EXPECT_FALSE(watch.clockJumpedBack(ros::Time(100.95)));  // jitter
  EXPECT_TRUE(watch.clockJumpedBack(ros::Time(50.0)));
  EXPECT_FALSE(watch.clockJumpedBack(ros::Time(50.1)));
}

TEST(ClockWatch, NoticesABagThatLoopsWithoutItsClock) {
  ClockWatch watch;
  for (int n = 0; n < 50; ++n) EXPECT_FALSE(watch.stampsJumpedBack(ros::Time(100.0 + 0.1 * n)));
  EXPECT_FALSE(watch.stampsJumpedBack(ros::Time(100.0)));
  EXPECT_FALSE(watch.stampsJumpedBack(ros::Time(100.1)));
  EXPECT_TRUE(watch.stampsJumpedBack(ros::Time(100.2)));
  EXPECT_FALSE(watch.stampsJumpedBack(ros::Time(100.3)));
}

TEST(ClockWatch, ASingleLateScanIsNoJump) {
  ClockWatch watch;
  for (int n = 0; n < 50; ++n) {
    EXPECT_FALSE(watch.stampsJumpedBack(ros::Time(100.0 + 0.1 * n)));
    EXPECT_FALSE(watch.stampsJumpedBack(ros::Time(90.0)));
    EXPECT_FALSE(watch.stampsJumpedBack(ros::Time()));
  }
}

}  // namespace
}  // namespace ttsdf
