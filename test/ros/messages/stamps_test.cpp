// Stamps of messages may hold any number: nothing throws, and what cannot be compared is said.

#include "ros/messages/stamps.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "ros/node/scan_input.h"
#include "ros/scans/clock_watch.h"
#include "ros/scans/gravity_hint.h"
#include "ros/scans/scan_localizer.h"
#include "ros/scans/transform_buffer.h"

namespace ttsdf {
namespace {

const ros::Time kNow(1750000000, 250000000);
const ros::Time kEnd(4294967295U, 999999999U);

TEST(Stamps, DifferencesAreRightWhateverTheTimesAre) {
  EXPECT_DOUBLE_EQ(secondsBetween(ros::Time(10, 900000000), ros::Time(12, 100000000)), 1.2);
  EXPECT_DOUBLE_EQ(secondsBetween(ros::Time(12, 100000000), ros::Time(10, 900000000)), -1.2);
  EXPECT_NEAR(secondsBetween(ros::Time(), kEnd), 4294967296.0, 1e-6);
  EXPECT_NEAR(secondsBetween(kEnd, ros::Time()), -4294967296.0, 1e-6);
}

TEST(Stamps, SumsAreRightAndLimited) {
  EXPECT_EQ(addSeconds(ros::Time(10, 900000000), 0.2), ros::Time(11, 100000000));
  EXPECT_EQ(addSeconds(ros::Time(10, 100000000), -0.2), ros::Time(9, 900000000));
  EXPECT_EQ(addSeconds(kNow, 0.1), kNow + ros::Duration(0.1));
  EXPECT_EQ(addSeconds(kEnd, 0.1), ros::TIME_MAX);
  EXPECT_EQ(addSeconds(kNow, std::numeric_limits<double>::infinity()), ros::TIME_MAX);
  EXPECT_EQ(addSeconds(ros::Time(1.0), -2.0), ros::TIME_MIN);
  EXPECT_EQ(addSeconds(kNow, std::numeric_limits<double>::quiet_NaN()), kNow);
  EXPECT_EQ(toTime(1000.5), ros::Time(1000, 500000000));
  EXPECT_EQ(toTime(4294967296.0), ros::TIME_MAX);
}

TEST(Stamps, WhatCannotBeComparedWithTheClockIsSaid) {
  EXPECT_EQ(stampProblem(kNow, kNow), "");
  EXPECT_EQ(stampProblem(ros::Time(), kNow), "");
  EXPECT_EQ(stampProblem(kNow, ros::Time()), "");
  const std::string problem = stampProblem(kEnd, kNow);
  EXPECT_NE(problem.find("4294967295.999999999"), std::string::npos) << problem;
  EXPECT_NE(problem.find("after now"), std::string::npos) << problem;
  EXPECT_NE(stampProblem(kNow, kEnd).find("before now"), std::string::npos);
}

geometry_msgs::TransformStamped odometry(const ros::Time& stamp) {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = "odom";
  transform.child_frame_id = "base";
  transform.header.stamp = stamp;
  transform.transform.rotation.w = 1.0;
  return transform;
}

TEST(Stamps, ATransformThatCannotBeComparedIsLeftOutAndTheOthersAreTaken) {
  tf2::BufferCore buffer;
  EXPECT_TRUE(addTransform(buffer, odometry(kNow), "test", false, kNow).taken);
  const AddedTransform far = addTransform(buffer, odometry(kEnd), "test", false, kNow);
  EXPECT_FALSE(far.taken);
  EXPECT_NE(far.left_out.find("'odom' -> 'base'"), std::string::npos) << far.left_out;
  const ros::Time later = addSeconds(kNow, 1.0);
  EXPECT_TRUE(addTransform(buffer, odometry(later), "test", false, later).taken);
  EXPECT_EQ(buffer.lookupTransform("odom", "base", ros::Time(0)).header.stamp, later);
  // Old, and nothing more.
  const AddedTransform old = addTransform(buffer, odometry(ros::Time(5.0)), "test", false, later);
  EXPECT_FALSE(old.taken);
  EXPECT_EQ(old.left_out, "");
  geometry_msgs::TransformStamped mount = odometry(kEnd);
  mount.child_frame_id = "camera";
  EXPECT_TRUE(addTransform(buffer, mount, "test", true, kNow).taken) << "a static one has no time";
}

TEST(Stamps, ScansOfAnyStampLeaveTheQueue) {
  for (const ros::Time& stamp : {ros::Time(1, 0), ros::Time(3000000000U, 0), kEnd}) {
    tf2::BufferCore buffer;
    buffer.setTransform(odometry(ros::Time(1000.0)), "test");
    ScanQueue::Options options;
    options.targets = {"base"};
    options.odometry = "odom";
    ScanQueue queue(options, buffer);
    QueuedScan scan;
    scan.header.stamp = stamp;
    scan.header.frame_id = "odom";
    queue.put(scan, ros::Time(1000.0));
    EXPECT_NE(queue.whyWaiting(), "") << stamp;
    const std::optional<ScanQueue::Taken> taken = queue.take(kEnd);
    ASSERT_TRUE(taken) << stamp;
    EXPECT_NE(taken->missing, "") << stamp;
  }
}

TEST(Stamps, AnImuOfAnyStampGivesTheDirectionAgain) {
  GravityOptions options;
  options.gravity_source = "imu";
  tf2::BufferCore buffer;
  GravityHint hint(options, FrameOptions(), buffer);
  sensor_msgs::Imu imu;
  imu.header.frame_id = "imu";
  imu.linear_acceleration.z = 9.81;
  imu.header.stamp = kNow;
  EXPECT_EQ(hint.add(imu, kNow), "");
  sensor_msgs::Imu far = imu;
  far.header.stamp = kEnd;
  far.linear_acceleration.z = -9.81;
  EXPECT_NE(hint.add(far, kNow).find("4294967295"), std::string::npos);
  imu.header.stamp = addSeconds(kNow, 0.01);
  EXPECT_EQ(hint.add(imu, kNow), "");
  EXPECT_NEAR((*hint.down("imu", kNow) + Eigen::Vector3d::UnitZ()).norm(), 0.0, 1e-12);
}

TEST(Stamps, AStartPoseOfAnyStampIsTakenForNow) {
  tf2::BufferCore buffer;
  buffer.setTransform(odometry(kNow), "test");
  geometry_msgs::PoseWithCovarianceStamped pose;
  pose.header.frame_id = "map";
  pose.header.stamp = kEnd;
  pose.pose.pose.orientation.w = 1.0;
  FrameOptions frames;
  frames.base_frame_id = "base";
  const PoseRequest request = readPose(pose, buffer, frames, "initialpose", kNow);
  EXPECT_TRUE(request.stamp.isZero());
  EXPECT_NE(request.warning.find("taken for now"), std::string::npos) << request.warning;
  PoseRequest unchecked = request;
  unchecked.stamp = kEnd;
  EXPECT_FALSE(withOdometry(unchecked, buffer, frames).T_odom_base);
}

TEST(Stamps, AScanOfTheEndOfTimeIsRefusedByItsStamp) {
  ros::Time::init();
  std_msgs::Header header;
  header.frame_id = "camera";
  header.stamp = kEnd;
  const std::string problem = headerProblem(header);
  EXPECT_NE(problem.find("4294967295"), std::string::npos) << problem;
  EXPECT_NE(problem.find("future"), std::string::npos) << problem;
}

}  // namespace
}  // namespace ttsdf
