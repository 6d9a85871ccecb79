// The simulated camera as others meet it: messages, TF and services, held against the analytic scene.
#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <cmath>
#include <cstring>
#include <deque>

#include "ttsdf_localization/simulation/worlds.h"

namespace ttsdf {
namespace {

class SimulatedCamera : public testing::Test {
 protected:
  SimulatedCamera() : listener_(buffer_) {
    subscribers_ = {nh_.subscribe<geometry_msgs::PoseStamped>(
                        "ground_truth", 1000, [this](const auto& m) { truths_.push_back(m); }),
                    nh_.subscribe<sensor_msgs::PointCloud2>("cloud", 1000,
                                                            [this](const auto& m) { clouds_.push_back(m); }),
                    nh_.subscribe<sensor_msgs::Image>("depth/image_raw", 1000,
                                                      [this](const auto& m) { images_.push_back(m); }),
                    nh_.subscribe<sensor_msgs::CameraInfo>("depth/camera_info", 1000,
                                                           [this](const auto& m) { info_ = m; })};
  }

  template <class Condition>
  bool waitFor(const Condition& condition, double seconds = 30.0) {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(seconds);
    while (ros::ok() && ros::WallTime::now() < end) {
      if (condition()) return true;
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.05));
    }
    return condition();
  }

  template <class Service>
  typename Service::Response call(const std::string& name, typename Service::Request request = {}) {
    Service service;
    service.request = request;
    EXPECT_TRUE(ros::service::waitForService(name, ros::Duration(30.0)));
    EXPECT_TRUE(ros::service::call(name, service));
    return service.response;
  }

  void switchTo(const std::string& name, bool on) {
    std_srvs::SetBool::Request request;
    request.data = static_cast<std::uint8_t>(on);
    EXPECT_TRUE(call<std_srvs::SetBool>(name, request).success);
  }

  geometry_msgs::PoseStampedConstPtr truthAt(const ros::Time& stamp) const {
    for (const auto& truth : truths_) {
      if (truth->header.stamp == stamp) return truth;
    }
    return nullptr;
  }

  Eigen::Isometry3d transform(const std::string& target, const std::string& source, const ros::Time& stamp) {
    return tf2::transformToEigen(buffer_.lookupTransform(target, source, stamp));
  }

  static Eigen::Isometry3d poseOf(const geometry_msgs::PoseStamped& message) {
    Eigen::Isometry3d T;
    tf2::fromMsg(message.pose, T);
    return T;
  }

  ros::NodeHandle nh_;
  tf2_ros::Buffer buffer_;
  tf2_ros::TransformListener listener_;
  std::vector<ros::Subscriber> subscribers_;
  std::deque<geometry_msgs::PoseStampedConstPtr> truths_;
  std::deque<sensor_msgs::PointCloud2ConstPtr> clouds_;
  std::deque<sensor_msgs::ImageConstPtr> images_;
  sensor_msgs::CameraInfoConstPtr info_;
};

TEST_F(SimulatedCamera, CloudsLieOnTheSceneWhereTruthAndMountSay) {
  ASSERT_TRUE(waitFor([&] { return clouds_.size() >= 5; }));
  const AnalyticScene scene = makeApartment();
  const auto cloud = clouds_.back();
  EXPECT_EQ(cloud->header.frame_id, "camera_depth_optical_frame");
  ASSERT_TRUE(waitFor([&] { return truthAt(cloud->header.stamp) != nullptr; }));
  const Eigen::Isometry3d T = poseOf(*truthAt(cloud->header.stamp)) *
                              transform("base_link", cloud->header.frame_id, cloud->header.stamp);
  int readings = 0;
  sensor_msgs::PointCloud2ConstIterator<float> p(*cloud, "x");
  for (; p != p.end(); ++p) {
    if (std::isnan(p[0])) continue;
    ++readings;
    // Single precision of cloud and message.
    ASSERT_LT(std::abs(scene.signedDistance(T * Eigen::Vector3d(p[0], p[1], p[2]))), 2e-6);
  }
  EXPECT_GT(readings, 2000);
}

TEST_F(SimulatedCamera, ImageAndCalibrationSayTheSameAsTheCloud) {
  ASSERT_TRUE(waitFor([&] { return images_.size() >= 5 && clouds_.size() >= 5 && info_; }));
  for (const auto& image : images_) {
    for (const auto& cloud : clouds_) {
      if (image->header.stamp != cloud->header.stamp) continue;
      ASSERT_EQ(image->width, cloud->width);
      ASSERT_EQ(image->encoding, "16UC1");
      sensor_msgs::PointCloud2ConstIterator<float> p(*cloud, "x");
      for (std::size_t i = 0; p != p.end(); ++p, ++i) {
        std::uint16_t millimetres = 0;
        std::memcpy(&millimetres, &image->data[2 * i], 2);
        if (std::isnan(p[2])) {
          ASSERT_EQ(millimetres, 0);
        } else {
          ASSERT_NEAR(millimetres, 1000.0 * p[2], 0.51);
          ASSERT_NEAR(info_->K[0] * p[0] / p[2] + info_->K[2], static_cast<double>(i % image->width), 1e-3);
        }
      }
      return;
    }
  }
  FAIL() << "no image and cloud of the same stamp";
}

TEST_F(SimulatedCamera, StampsRiseAndTruthMovesSmoothly) {
  ASSERT_TRUE(waitFor([&] { return truths_.size() >= 40; }));
  for (std::size_t i = 1; i < truths_.size(); ++i) {
    const double passed = (truths_[i]->header.stamp - truths_[i - 1]->header.stamp).toSec();
    EXPECT_GT(passed, 0.0);
    EXPECT_EQ(truths_[i]->header.frame_id, "map");
    const double moved = (poseOf(*truths_[i - 1]).inverse() * poseOf(*truths_[i])).translation().norm();
    EXPECT_LE(moved, 0.5 * passed + 1e-9);  // the parameter path/speed
  }
}

TEST_F(SimulatedCamera, TrueTransformLeadsToTheTruth) {
  switchTo("camera/truth_tf", true);
  truths_.clear();
  ASSERT_TRUE(waitFor([&] { return truths_.size() >= 10; }));
  const auto truth = truths_[8];
  ASSERT_TRUE(waitFor([&] { return buffer_.canTransform("map", "base_link", truth->header.stamp); }));
  EXPECT_TRUE(transform("map", "base_link", truth->header.stamp).isApprox(poseOf(*truth), 1e-9));
  switchTo("camera/truth_tf", false);
  truths_.clear();
  ASSERT_TRUE(waitFor([&] { return truths_.size() >= 10; }));
  EXPECT_FALSE(buffer_.canTransform("map", "odom", truths_.back()->header.stamp));
}

TEST_F(SimulatedCamera, OdometryCanBePaused) {
  ASSERT_TRUE(waitFor([&] { return truths_.size() >= 5; }));
  ASSERT_TRUE(waitFor([&] { return buffer_.canTransform("odom", "base_link", truths_[2]->header.stamp); }));
  switchTo("camera/pause_odometry", true);
  truths_.clear();
  ASSERT_TRUE(waitFor([&] { return truths_.size() >= 10; }));
  EXPECT_FALSE(buffer_.canTransform("odom", "base_link", truths_.back()->header.stamp));
  switchTo("camera/pause_odometry", false);
  truths_.clear();
  ASSERT_TRUE(waitFor([&] { return truths_.size() >= 10; }));
  EXPECT_TRUE(waitFor([&] { return buffer_.canTransform("odom", "base_link", truths_[5]->header.stamp); }));
}

TEST_F(SimulatedCamera, KidnappingMovesTheTruthAndNotTheOdometry) {
  ASSERT_TRUE(waitFor([&] { return truths_.size() >= 5; }));
  const auto response = call<std_srvs::Trigger>("camera/kidnap");
  EXPECT_TRUE(response.success) << response.message;
  const std::size_t seen = truths_.size();
  ASSERT_TRUE(waitFor([&] { return truths_.size() >= seen + 10; }));
  int jumps = 0;
  for (std::size_t i = 1; i < truths_.size(); ++i) {
    const double moved = (poseOf(*truths_[i]).translation() - poseOf(*truths_[i - 1]).translation()).norm();
    if (moved < 1.0) continue;
    ++jumps;
    EXPECT_GE(moved, 4.9);
    const ros::Time before = truths_[i - 1]->header.stamp, after = truths_[i]->header.stamp;
    ASSERT_TRUE(waitFor([&] { return buffer_.canTransform("odom", "base_link", after); }));
    const Eigen::Isometry3d odometry =
        transform("odom", "base_link", before).inverse() * transform("odom", "base_link", after);
    EXPECT_LT(odometry.translation().norm(), 0.1);
  }
  EXPECT_EQ(jumps, 1);
}

TEST_F(SimulatedCamera, StandsStillOnRequest) {
  switchTo("camera/stand_still", true);
  truths_.clear();
  ASSERT_TRUE(waitFor([&] { return truths_.size() >= 15; }));
  EXPECT_TRUE(poseOf(*truths_[5]).isApprox(poseOf(*truths_.back())));
  switchTo("camera/stand_still", false);
}

}  // namespace
}  // namespace ttsdf

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "simulated_camera_test");
  return RUN_ALL_TESTS();
}
