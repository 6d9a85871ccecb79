// dynamic_reconfigure's service and topics on a running nodelet: a gate closed and opened again while scans
// come in.

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/ConfigDescription.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <tf2_msgs/TFMessage.h>

#include <condition_variable>
#include <functional>
#include <mutex>
#include <vector>

#include "../support/room.h"
#include "ros/messages/cloud_conversion.h"
#include "ros/messages/conversions.h"
#include "synthetic_scans.h"
#include "ttsdf_localization/LocalizationStatus.h"

namespace ttsdf {
namespace {

using Status = ttsdf_localization::LocalizationStatus;
using dynamic_reconfigure::Config;

/// A camera that stands still in the room and sees it ten times a second.
class StandingRobot {
 public:
  explicit StandingRobot(ros::NodeHandle& node)
      : points_(test::renderScan(test::Room(), pose())),
        tf_(node.advertise<tf2_msgs::TFMessage>("/tf", 10)),
        clouds_(node.advertise<sensor_msgs::PointCloud2>("cloud", 2)),
        poses_(node.advertise<geometry_msgs::PoseWithCovarianceStamped>("initialpose", 2)),
        timer_(node.createWallTimer(ros::WallDuration(0.1), [this](const ros::WallTimerEvent&) { step(); })) {
  }

  /// The base is the camera.
  static Eigen::Isometry3d pose() { return test::cameraPose({1.6, 1.2, 1.2}, 0.5, 0.1); }

  void givePose() {
    geometry_msgs::PoseWithCovarianceStamped message;
    message.header.frame_id = "map";
    message.pose.pose = toPoseMessage(pose());
    for (std::size_t i = 0; i < 6; ++i) message.pose.covariance[7 * i] = 0.01;
    poses_.publish(message);
  }
  bool heard() const { return poses_.getNumSubscribers() > 0; }

 private:
  void step() {
    const ros::Time now = ros::Time::now();
    tf2_msgs::TFMessage tf;
    tf.transforms = {stampedTransform(Eigen::Isometry3d::Identity(), "odom", "base_link", now),
                     stampedTransform(Eigen::Isometry3d::Identity(), "base_link", "camera", now)};
    tf_.publish(tf);
    std_msgs::Header header;
    header.stamp = now;
    header.frame_id = "camera";
    clouds_.publish(toCloudMessage(points_, header));
  }

  const ScanPoints points_;
  ros::Publisher tf_, clouds_, poses_;
  ros::WallTimer timer_;
};

class LiveParametersNode : public testing::Test {
 protected:
  LiveParametersNode() : robot_(node_) {
    statuses_ = node_.subscribe<Status>("status", 100, [this](const ros::MessageEvent<const Status>& event) {
      const std::lock_guard<std::mutex> lock(mutex_);
      status_ = *event.getConstMessage();
      changed_.notify_all();
    });
    service_ = node_.serviceClient<dynamic_reconfigure::Reconfigure>("localization/set_parameters");
  }

  bool waitFor(const std::function<bool(const Status&)>& condition) {
    std::unique_lock<std::mutex> lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(60), [&] { return condition(status_); });
  }
  std::string status() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return status_.state_name + ": " + status_.message;
  }

  bool set(const std::string& name, double value, Config* reply = nullptr) {
    dynamic_reconfigure::Reconfigure call;
    call.request.config.doubles.emplace_back();
    call.request.config.doubles.back().name = name;
    call.request.config.doubles.back().value = value;
    const bool accepted = service_.call(call);
    if (reply) *reply = call.response.config;
    return accepted;
  }
  static double value(const Config& config, const std::string& name) {
    for (const auto& entry : config.doubles) {
      if (entry.name == name) return entry.value;
    }
    return std::nan("");
  }

  ros::NodeHandle node_;
  StandingRobot robot_;
  ros::Subscriber statuses_;
  ros::ServiceClient service_;
  std::mutex mutex_;
  std::condition_variable changed_;
  Status status_;
};

TEST_F(LiveParametersNode, AGateIsClosedAndOpenedWhileScansComeIn) {
  ASSERT_TRUE(service_.waitForExistence(ros::Duration(60.0)));
  ASSERT_TRUE(waitFor([this](const Status& s) { return !s.map_id.empty() && robot_.heard(); })) << status();
  robot_.givePose();
  ASSERT_TRUE(waitFor([](const Status& s) { return s.pose_valid; })) << status();

  Config reply;
  ASSERT_TRUE(set("gates/max_rms_residual", 1e-6, &reply));
  EXPECT_EQ(value(reply, "gates/max_rms_residual"), 1e-6);
  EXPECT_TRUE(waitFor([](const Status& s) { return s.reason == Status::REASON_RESIDUAL; })) << status();
  double kept = 0.0;
  EXPECT_TRUE(node_.getParam("localization/gates/max_rms_residual", kept));
  EXPECT_EQ(kept, 1e-6);

  ASSERT_TRUE(set("gates/max_rms_residual", 0.035));
  EXPECT_TRUE(waitFor([](const Status& s) { return s.pose_valid; })) << status();
}

TEST_F(LiveParametersNode, ABadValueIsRefusedAndNothingChanges) {
  ASSERT_TRUE(service_.waitForExistence(ros::Duration(60.0)));
  EXPECT_FALSE(set("gates/min_inlier_ratio", 7.0));
  EXPECT_FALSE(set("gates/nothing", 0.1));
  const auto updates =
      ros::topic::waitForMessage<Config>("localization/parameter_updates", node_, ros::Duration(30.0));
  ASSERT_TRUE(updates);
  EXPECT_EQ(value(*updates, "gates/min_inlier_ratio"), 0.35);
  const auto description = ros::topic::waitForMessage<dynamic_reconfigure::ConfigDescription>(
      "localization/parameter_descriptions", node_, ros::Duration(30.0));
  ASSERT_TRUE(description);
  EXPECT_EQ(value(description->dflt, "gates/min_inlier_ratio"), 0.35);
  EXPECT_EQ(value(description->max, "gates/min_inlier_ratio"), 1.0);
}

}  // namespace
}  // namespace ttsdf

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "live_parameters_test");
  ros::AsyncSpinner spinner(2);
  spinner.start();
  return RUN_ALL_TESTS();
}
