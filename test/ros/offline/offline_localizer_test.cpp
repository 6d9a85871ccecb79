// The program over bags of the analytic room: same result twice, right poses, clear errors.

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "../../support/room.h"
#include "../../tools/tool_process.h"
#include "../synthetic_scans.h"
#include "ros/messages/cloud_conversion.h"
#include "ros/messages/conversions.h"

namespace ttsdf {
namespace {

constexpr double kRate = 10.0;  // scans per second
constexpr double kStart = 1000.0;
const std::string kMap = std::string(TTSDF_TEST_MAPS) + "/room.ttsdf";

Eigen::Isometry3d baseFromCamera() {
  Eigen::Isometry3d T = test::cameraPose({0.15, 0.0, 1.2}, 0.0, 0.1);
  return T;
}

Eigen::Isometry3d poseOf(double t) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(0.5 + 0.2 * t, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.translation() << 1.6 + 0.2 * t, 1.2 + 0.15 * t, 0.0;
  return T;
}

struct Story {
  int scans = 40;
  bool odometry = true, initial_pose = true, depth_images = false, mount = true;
  bool binned = false, part = false;           ///< camera_info is of a larger sensor
  int row_step = -1;                           ///< 0: none; 1: of the whole cloud; as drivers have it
  bool transforms_late = false;                ///< odometry comes after its cloud
  int drop_out_begin = -1, drop_out_end = -1;  ///< scans without odometry
};

class BagWriter {
 public:
  BagWriter(const std::string& path, Story story) : story_(story), bag_(path, rosbag::bagmode::Write) {}

  void write() {
    const ros::Time start(kStart);
    tf2_msgs::TFMessage mount;
    mount.transforms = {stampedTransform(baseFromCamera(), "base_link", "camera", start)};
    if (story_.mount) bag_.write("/tf_static", start, mount);
    for (int n = 0; n < story_.scans; ++n) writeScan(n);
    bag_.close();
  }

 private:
  void writeScan(int n) {
    const ros::Time stamp(kStart + n / kRate);
    const Eigen::Isometry3d T_map_base = poseOf(n / kRate);
    if (n == 0 && story_.initial_pose) writeInitialPose(T_map_base, stamp);
    if (!story_.transforms_late) writeOdometry(n, T_map_base, stamp, stamp);
    std_msgs::Header header;
    header.frame_id = "camera";
    header.stamp = stamp;
    if (story_.depth_images) {
      writeDepth(T_map_base, header);
    } else {
      const ScanPoints points =
          test::renderScan(test::Room(), T_map_base * baseFromCamera(), 64, 48, 0.01, 1U + n);
      sensor_msgs::PointCloud2 cloud = toCloudMessage(points, header);
      if (story_.row_step >= 0) {
        cloud.height = 48;
        cloud.width /= 48;
        cloud.row_step = story_.row_step == 0 ? 0 : static_cast<std::uint32_t>(cloud.data.size());
      }
      bag_.write("/camera/points", stamp, cloud);
    }
    if (story_.transforms_late) writeOdometry(n, T_map_base, stamp, stamp + ros::Duration(0.03));
  }

  void writeOdometry(int n, const Eigen::Isometry3d& T_map_base, const ros::Time& stamp,
                     const ros::Time& written) {
    if (!story_.odometry || (n >= story_.drop_out_begin && n < story_.drop_out_end)) return;
    Eigen::Isometry3d T_map_odom = Eigen::Isometry3d::Identity();
    T_map_odom.translation() << 0.3, -0.2, 0.0;
    tf2_msgs::TFMessage tf;
    tf.transforms = {stampedTransform(T_map_odom.inverse() * T_map_base, "odom", "base_link", stamp)};
    bag_.write("tf", written, tf);
  }

  void writeInitialPose(const Eigen::Isometry3d& T_map_base, const ros::Time& stamp) {
    geometry_msgs::PoseWithCovarianceStamped message;
    message.header.frame_id = "map";
    message.header.stamp = stamp;
    message.pose.pose = toPoseMessage(T_map_base);
    for (std::size_t i = 0; i < 6; ++i) message.pose.covariance[7 * i] = 0.01;
    bag_.write("initialpose", stamp, message);
  }

  void writeDepth(const Eigen::Isometry3d& T_map_base, const std_msgs::Header& header) {
    constexpr int kWidth = 64, kHeight = 48;
    const ScanPoints points = test::renderScan(test::Room(), T_map_base * baseFromCamera(), kWidth, kHeight);
    sensor_msgs::Image image;
    image.header = header;
    image.width = kWidth;
    image.height = kHeight;
    image.encoding = "16UC1";
    image.step = 2 * kWidth;
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const auto millimetres = static_cast<std::uint16_t>(std::lround(1000.0F * points(2, i)));
      image.data.push_back(static_cast<std::uint8_t>(millimetres & 0xFF));
      image.data.push_back(static_cast<std::uint8_t>(millimetres >> 8));
    }
    sensor_msgs::CameraInfo info;
    info.header = header;
    info.width = kWidth;
    info.height = kHeight;
    const double focal = 0.866 * kWidth;
    info.K = {focal, 0, 0.5 * (kWidth - 1), 0, focal, 0.5 * (kHeight - 1), 0, 0, 1};
    info.P = {focal, 0, 0.5 * (kWidth - 1), 0, 0, focal, 0.5 * (kHeight - 1), 0, 0, 0, 1, 0};
    info.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    if (story_.binned) {  // the sensor has twice as many pixels each way
      info.binning_x = info.binning_y = 2;
      info.width *= 2;
      info.height *= 2;
      for (const std::size_t n : {0U, 2U, 5U, 6U}) info.P[n] *= 2.0;
    }
    if (story_.part) {  // ... and this is a part of it, which begins at (100, 60) of the whole
      info.roi.width = info.width;
      info.roi.height = info.height;
      info.roi.x_offset = 100;
      info.roi.y_offset = 60;
      info.width += 200;
      info.height += 100;
      info.P[2] += 100.0;
      info.P[6] += 60.0;
    }
    bag_.write("camera/depth/camera_info", header.stamp, info);
    bag_.write("camera/depth/image_rect", header.stamp, image);
  }

  const Story story_;
  rosbag::Bag bag_;
};

class OfflineLocalizer : public ::testing::Test {
 protected:
  std::string bag(const Story& story) {
    const std::string path = folder_ / "run.bag";
    BagWriter(path, story).write();
    return path;
  }

  ToolRun run(const std::string& bag, std::vector<std::string> more = {}, const std::string& name = "out") {
    std::vector<std::string> arguments = {bag,
                                          "--map",
                                          kMap,
                                          "--trajectory",
                                          folder_ / (name + ".tum"),
                                          "--statuses",
                                          folder_ / (name + ".csv")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runProcess("offline_localizer", arguments);
  }

  /// Positions by scan number.
  std::map<int, Eigen::Vector3d> trajectory() {
    std::map<int, Eigen::Vector3d> positions;
    for (const std::string& line : linesOf(fileContent(folder_ / "out.tum"))) {
      std::istringstream words(line);
      double stamp = 0.0;
      Eigen::Vector3d p;
      words >> stamp >> p.x() >> p.y() >> p.z();
      positions[static_cast<int>(std::lround((stamp - kStart) * kRate))] = p;
    }
    return positions;
  }

  void expectRightPoses(std::size_t least) {
    const auto positions = trajectory();
    EXPECT_GE(positions.size(), least);
    for (const auto& [n, p] : positions) {
      EXPECT_LT((p - poseOf(n / kRate).translation()).norm(), 0.02) << "scan " << n;
    }
  }

  TempFolder folder_;
};

TEST_F(OfflineLocalizer, TracksEveryScanWithOdometry) {
  const ToolRun done = run(bag({}));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_NE(done.out.find("scans                  40"), std::string::npos) << done.out;
  EXPECT_NE(done.out.find("times lost             0"), std::string::npos) << done.out;
  expectRightPoses(37);  // the first ones confirm the start pose
  EXPECT_EQ(linesOf(fileContent(folder_ / "out.csv")).size(), 41U);
}

TEST_F(OfflineLocalizer, GivesTheSameTwice) {
  Story story;
  story.initial_pose = false;  // found by global localization, which runs in several threads
  const std::string path = bag(story);
  for (const char* name : {"one", "two"}) {
    const ToolRun done = run(path, {"--set", "recovery/start_globally=true"}, name);
    ASSERT_EQ(done.exit_code, 0) << done.err;
    EXPECT_NE(done.out.find("global localizations   1"), std::string::npos) << done.out;
  }
  EXPECT_GT(linesOf(fileContent(folder_ / "one.tum")).size(), 30U);
  EXPECT_EQ(fileContent(folder_ / "one.tum"), fileContent(folder_ / "two.tum"));
  EXPECT_EQ(fileContent(folder_ / "one.csv"), fileContent(folder_ / "two.csv"));
}

TEST_F(OfflineLocalizer, WaitsForOdometryThatComesLate) {
  Story story;
  story.transforms_late = true;
  ASSERT_EQ(run(bag(story)).exit_code, 0);
  expectRightPoses(37);
}

TEST_F(OfflineLocalizer, BridgesTwoSecondsWithoutOdometry) {
  Story story;
  story.drop_out_begin = 12;
  story.drop_out_end = 32;
  ASSERT_EQ(run(bag(story)).exit_code, 0);
  expectRightPoses(37);
  const std::string statuses = fileContent(folder_ / "out.csv");
  EXPECT_NE(statuses.find("odometry is missing"), std::string::npos);
  EXPECT_EQ(statuses.find(",lost,"), std::string::npos);
}

TEST_F(OfflineLocalizer, TracksWithoutAnyOdometry) {
  Story story;
  story.odometry = false;
  ASSERT_EQ(run(bag(story), {"--set", "odom_frame_id=none"}).exit_code, 0);
  expectRightPoses(37);
}

TEST_F(OfflineLocalizer, SaysWhichTransformIsMissing) {
  Story story;
  story.odometry = false;
  const ToolRun done = run(bag(story));
  EXPECT_EQ(done.exit_code, 3) << done.err;
  EXPECT_TRUE(trajectory().empty());
  EXPECT_NE(fileContent(folder_ / "out.csv").find("odom"), std::string::npos);
}

TEST_F(OfflineLocalizer, SaysWhyThereIsNoPose) {
  Story story;
  story.mount = false;
  const ToolRun done = run(bag(story), {"--summary", folder_ / "summary.json"});
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_NE(done.err.find("'camera' -> 'base_link'"), std::string::npos) << done.err;
  const std::string summary = fileContent(folder_ / "summary.json");
  EXPECT_NE(summary.find("\"poses\" : 0"), std::string::npos) << summary;
  EXPECT_NE(summary.find("40 of 40 scans: its transforms did not come in time"), std::string::npos)
      << summary;
}

TEST_F(OfflineLocalizer, WritesASummaryAndCovariances) {
  const ToolRun done =
      run(bag({}), {"--summary", folder_ / "summary.json", "--covariances", folder_ / "covariances.csv"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const std::string summary = fileContent(folder_ / "summary.json");
  for (const char* key :
       {"\"scans\" : 40", "\"times_lost\" : 0", "\"reason\" : \"\"", "map_memory_bytes", "median_ms"})
    EXPECT_NE(summary.find(key), std::string::npos) << key << '\n' << summary;
  const auto lines = linesOf(fileContent(folder_ / "covariances.csv"));
  EXPECT_EQ(lines.size(), linesOf(fileContent(folder_ / "out.tum")).size() + 1);
  EXPECT_EQ(lines[0].substr(0, 13), "stamp,c00,c01");
  EXPECT_EQ(std::count(lines[1].begin(), lines[1].end(), ','), 36);
}

TEST_F(OfflineLocalizer, ReadsCloudsOfRealDrivers) {
  for (const int row_step : {0, 1}) {
    Story story;
    story.row_step = row_step;
    const ToolRun done = run(bag(story));
    ASSERT_EQ(done.exit_code, 0) << done.err;
    expectRightPoses(37);
  }
}

TEST_F(OfflineLocalizer, ReadsBinnedImagesAndPartsOfTheSensor) {
  for (const auto& [binned, part] : {std::pair{true, false}, {false, true}, {true, true}}) {
    Story story;
    story.depth_images = true;
    story.binned = binned;
    story.part = part;
    const ToolRun done = run(bag(story));
    ASSERT_EQ(done.exit_code, 0) << done.err;
    expectRightPoses(37);
  }
}

TEST_F(OfflineLocalizer, OtherBagsAndDamagedOnesAreNamed) {
  expectError(run(folder_.write("run.db3", "SQLite format 3 and more")), 1, {"ROS 2"});
  expectError(run(folder_.write("run.mcap", "\x89MCAP0\r\n and more bytes")), 1, {"MCAP"});
  expectError(run(folder_.write("old.bag", "#ROSBAG V1.2\n and more")), 1, {"old format"});
  expectError(run(folder_.write("none.bag", "")), 1, {"an empty file"});
  const std::string whole = fileContent(bag({}));
  for (const double share : {0.1, 0.5, 0.9, 0.999}) {
    const auto size = static_cast<std::size_t>(share * static_cast<double>(whole.size()));
    expectError(run(folder_.write("cut.bag", whole.substr(0, size))), 1, {"cut.bag", "rosbag reindex"});
  }
}

TEST_F(OfflineLocalizer, AnOptionFileThatHoldsItselfDoesNotEndTheProgramByASignal) {
  const std::string path = bag({});
  for (const char* text : {"a: &a [*a]", "a: &a {b: *a}", "a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]"}) {
    const ToolRun done = run(path, {"--config", folder_.write("own.yaml", text)});
    EXPECT_TRUE(done.exit_code >= 0 && done.exit_code <= 2) << text << ": " << done.exit_code << done.err;
  }
}

TEST_F(OfflineLocalizer, MakesCloudsFromDepthImages) {
  Story story;
  story.depth_images = true;
  const ToolRun done = run(bag(story));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  expectRightPoses(37);
}

TEST_F(OfflineLocalizer, HasHelpAndRefusesWrongUsage) {
  const ToolRun help = runProcess("offline_localizer", {"--help"});
  EXPECT_EQ(help.exit_code, 0);
  for (const char* flag : {"--map", "--trajectory", "--statuses", "--config", "--set"}) {
    EXPECT_NE(help.out.find(flag), std::string::npos) << flag;
  }
  expectError(runProcess("offline_localizer", {"run.bag"}), 2, {"--map"});
  const std::string path = bag({});
  EXPECT_EQ(run(path, {"--set", "gates/min_inlier_ration=0.3"}).exit_code, 2);
  EXPECT_EQ(run(path, {"--set", "gates/min_inlier_ratio=7"}).exit_code, 2);
  EXPECT_EQ(run(path, {"--set", "nonsense"}).exit_code, 2);
}

TEST_F(OfflineLocalizer, RefusesBadInputAndLeavesNoHalfOutput) {
  const std::string path = bag({});
  expectError(run("/no/such.bag"), 1, {"/no/such.bag"});
  expectError(run(folder_.write("text.bag", "this is no bag")), 1, {"text.bag"});
  expectError(run(folder_.write("cut.bag", fileContent(path).substr(0, 20000))), 1, {"cut.bag"});
  expectError(run(path, {"--cloud", "nowhere"}), 1, {"nowhere", "camera/points"});
  expectError(run(path, {"--map", folder_.write("bad.ttsdf", "no map")}), 2, {"map"});  // given twice
  for (const char* name : {"out.tum", "out.csv", "out.tum.part"}) {
    EXPECT_TRUE(fileContent(folder_ / name).empty()) << name;
  }
}

}  // namespace
}  // namespace ttsdf
