// Scans that wait for late, slow, silent and missing odometry.

#include "ros/scans/scan_queue.h"

#include <gtest/gtest.h>

#include <cmath>

namespace ttsdf {
namespace {

geometry_msgs::TransformStamped transform(const std::string& parent, const std::string& child, double stamp,
                                          double x = 0.0) {
  geometry_msgs::TransformStamped message;
  message.header.frame_id = parent;
  message.child_frame_id = child;
  message.header.stamp = ros::Time(stamp);
  message.transform.translation.x = x;
  message.transform.rotation.w = 1.0;
  return message;
}

/// A robot whose odometry and scans come when they come.
class Robot : public ::testing::Test {
 protected:
  Robot() { buffer_.setTransform(transform("base", "camera", 0.0), "test", true); }

  static ScanQueue::Options options() {
    ScanQueue::Options options;
    options.targets = {"base"};
    options.odometry = "odom";
    options.odometry_timeout = 0.5;
    options.size = 100;
    return options;
  }
  void odometry(double stamp) { buffer_.setTransform(transform("odom", "base", stamp, stamp), "test"); }
  static QueuedScan scan(double stamp, const std::string& frame = "camera") {
    QueuedScan scan;
    scan.header.stamp = ros::Time(stamp);
    scan.header.frame_id = frame;
    return scan;
  }

  struct Result {
    int with = 0, without = 0, rejected = 0, overtaken = 0;
    bool in_order = true;
  };
  /// Clouds at `cloud_rate`, odometry at `odometry_rate` that comes `late` [s], for `seconds`; odometry is
  /// silent within [silent_from, silent_to).
  Result run(double cloud_rate, double odometry_rate, double late, double seconds, double silent_from = 1e9,
             double silent_to = 1e9) {
    ScanQueue queue(options(), buffer_);
    Result result;
    double next_cloud = 100.0 + 0.003, next_odometry = 100.0, last_stamp = 0.0;
    for (double now = 100.0; now < 100.0 + seconds; now += 0.001) {
      if (now >= next_odometry + late) {
        if (next_odometry < silent_from || next_odometry >= silent_to) odometry(next_odometry);
        next_odometry += 1.0 / odometry_rate;
      }
      if (now >= next_cloud + 0.02) {
        queue.put(scan(next_cloud), ros::Time(now));
        next_cloud += 1.0 / cloud_rate;
      }
      while (const auto taken = queue.take(ros::Time(now))) {
        result.in_order = result.in_order && taken->scan.header.stamp.toSec() > last_stamp;
        last_stamp = taken->scan.header.stamp.toSec();
        ++(!taken->missing.empty()   ? result.rejected
           : taken->overtaken        ? result.overtaken
           : taken->without_odometry ? result.without
                                     : result.with);
      }
    }
    return result;
  }

  tf2::BufferCore buffer_;
};

TEST_F(Robot, LateOdometryIsWaitedFor) {
  for (const double cloud_rate : {1.0, 2.0, 10.0, 30.0}) {
    for (const double late : {0.0, 0.08, 0.3, 0.6}) {
      for (const double odometry_rate : {10.0, 30.0}) {
        buffer_.clear();
        const Result result = run(cloud_rate, odometry_rate, late, 10.0);
        const std::string what = std::to_string(cloud_rate) + " Hz, " + std::to_string(late) + " s late";
        EXPECT_EQ(result.without + result.rejected + result.overtaken, 0) << what;
        EXPECT_GE(result.with, static_cast<int>(cloud_rate * (10.0 - 1.0)) - 1) << what;
        EXPECT_TRUE(result.in_order) << what;
      }
    }
  }
}

TEST_F(Robot, SlowOdometryIsWaitedFor) {
  for (const double rate : {1.0, 2.0, 5.0}) {
    for (const double late : {0.0, 0.5, 1.0}) {
      buffer_.clear();
      const Result result = run(5.0, rate, late, 20.0);
      // Until its period is known, it may look silent.
      EXPECT_LE(result.without, 10) << rate << " Hz, " << late << " s late";
      EXPECT_EQ(result.rejected + result.overtaken, 0) << rate << " Hz, " << late << " s late";
      EXPECT_GE(result.with, 75) << rate << " Hz, " << late << " s late";
      EXPECT_TRUE(result.in_order);
    }
  }
}

TEST_F(Robot, APauseOfTheCloudsIsNoSilenceOfTheOdometry) {
  ScanQueue queue(options(), buffer_);
  for (double t = 100.0; t < 100.5; t += 0.05) odometry(t);
  queue.put(scan(100.42), ros::Time(100.45));
  ASSERT_TRUE(queue.take(ros::Time(100.5)));
  for (double t = 100.5; t < 103.5; t += 0.05) odometry(t);
  queue.put(scan(103.505), ros::Time(103.51));
  EXPECT_FALSE(queue.take(ros::Time(103.52))) << "its odometry is 80 ms late, and comes";
  odometry(103.51);
  const auto taken = queue.take(ros::Time(103.59));
  ASSERT_TRUE(taken);
  EXPECT_FALSE(taken->without_odometry);
}

TEST_F(Robot, SilentOdometryIsBridgedAndUsedAgainWhenItIsBack) {
  const Result result = run(10.0, 20.0, 0.02, 12.0, 104.0, 107.0);
  EXPECT_EQ(result.rejected, 0);
  EXPECT_NEAR(result.without, 30, 6);
  EXPECT_GE(result.with, 80);
  EXPECT_TRUE(result.in_order);
}

TEST_F(Robot, OdometryThatNeverWasThereIsNotBridged) {
  const Result result = run(10.0, 20.0, 0.0, 8.0, 0.0, 1e9);
  EXPECT_EQ(result.with + result.without, 0);
  EXPECT_GT(result.rejected, 40);
}

TEST_F(Robot, AMissingMountIsSaidAndHoldsUpNoOtherCamera) {
  ScanQueue queue(options(), buffer_);
  for (double t = 99.0; t < 104.0; t += 0.05) odometry(t);
  queue.put(scan(100.0, "nowhere"), ros::Time(100.0));
  queue.put(scan(100.1), ros::Time(100.1));
  auto taken = queue.take(ros::Time(100.2));
  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->scan.header.frame_id, "camera");
  EXPECT_NE(queue.whyWaiting().find("nowhere"), std::string::npos);
  EXPECT_FALSE(queue.take(ros::Time(100.3)));
  taken = queue.take(ros::Time(103.0));
  ASSERT_TRUE(taken);
  EXPECT_NE(taken->missing.find("'nowhere' -> 'base'"), std::string::npos) << taken->missing;
  EXPECT_TRUE(queue.empty());
}

TEST_F(Robot, TheQueueIsBoundedAndNothingIsLostWithoutAWord) {
  ScanQueue queue(options(), buffer_);
  int out = 0;
  for (int n = 0; n < 110; ++n) queue.put(scan(100.0 + 0.01 * n), ros::Time(100.0 + 0.001 * n));
  while (const auto taken = queue.take(ros::Time(100.4))) {
    EXPECT_FALSE(taken->missing.empty());
    ++out;
  }
  EXPECT_EQ(out, 10);
  while (queue.take(ros::Time(100.4), false, true)) ++out;
  EXPECT_EQ(out, 110);
}

TEST_F(Robot, WhoIsBehindTakesTheNewest) {
  ScanQueue queue(options(), buffer_);
  for (double t = 99.0; t < 101.0; t += 0.05) odometry(t);
  for (int n = 0; n < 5; ++n) queue.put(scan(100.0 + 0.1 * n), ros::Time(100.5));
  int overtaken = 0;
  while (const auto taken = queue.take(ros::Time(100.5), true)) {
    if (taken->overtaken) {
      ++overtaken;
    } else {
      EXPECT_EQ(taken->scan.header.stamp, ros::Time(100.4));
    }
  }
  EXPECT_EQ(overtaken, 4);
}

TEST_F(Robot, AScanOlderThanTheTransformsIsRefusedAtOnce) {
  ScanQueue queue(options(), buffer_);
  for (double t = 2000.0; t < 2001.0; t += 0.05) odometry(t);
  queue.put(scan(1000.0), ros::Time(2001.0));
  const auto taken = queue.take(ros::Time(2001.0));
  ASSERT_TRUE(taken);
  EXPECT_NE(taken->missing.find("older than the transforms"), std::string::npos) << taken->missing;
}

}  // namespace
}  // namespace ttsdf
