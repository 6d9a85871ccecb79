#include "ros/demo/depth_messages.h"

#include <gtest/gtest.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <cmath>
#include <cstring>

namespace ttsdf {
namespace {

DepthImage smallImage() { return {3, 2, {0.0f, 0.5f, 1.2345f, 2.0f, 65.0f, 70.0f}}; }

std_msgs::Header someHeader() {
  std_msgs::Header header;
  header.frame_id = "camera";
  header.stamp = ros::Time(12, 34);
  return header;
}

template <class Value>
Value pixel(const sensor_msgs::Image& image, std::size_t u, std::size_t v) {
  Value value;
  std::memcpy(&value, &image.data[v * image.step + u * sizeof(Value)], sizeof(Value));
  return value;
}

TEST(DepthMessages, MillimetresAreRoundedAndZeroWithoutReading) {
  const sensor_msgs::Image image = toImageMessage(smallImage(), "16UC1", someHeader());
  EXPECT_EQ(image.width, 3u);
  EXPECT_EQ(image.height, 2u);
  EXPECT_EQ(image.step, 6u);
  EXPECT_EQ(image.header.frame_id, "camera");
  EXPECT_EQ(image.header.stamp, ros::Time(12, 34));
  ASSERT_EQ(image.data.size(), 12u);
  EXPECT_EQ(pixel<std::uint16_t>(image, 0, 0), 0);
  EXPECT_EQ(pixel<std::uint16_t>(image, 1, 0), 500);
  EXPECT_NEAR(pixel<std::uint16_t>(image, 2, 0), 1234.5, 0.51);
  EXPECT_EQ(pixel<std::uint16_t>(image, 1, 1), 65000);
  EXPECT_EQ(pixel<std::uint16_t>(image, 2, 1), 0);  // beyond what 16 bits of millimetres can say
}

TEST(DepthMessages, MetresAreExactAndNanWithoutReading) {
  const sensor_msgs::Image image = toImageMessage(smallImage(), "32FC1", someHeader());
  EXPECT_EQ(image.step, 12u);
  EXPECT_TRUE(std::isnan(pixel<float>(image, 0, 0)));
  EXPECT_EQ(pixel<float>(image, 2, 0), 1.2345f);
  EXPECT_EQ(pixel<float>(image, 2, 1), 70.0f);
}

TEST(DepthMessages, UnknownEncodingIsRefused) {
  EXPECT_THROW(toImageMessage(smallImage(), "rgb8", someHeader()), std::invalid_argument);
}

TEST(DepthMessages, CloudIsTheImageSeenThroughThePinhole) {
  const CameraIntrinsics k{3, 2, 10.0, 20.0, 1.0, 0.5};
  const DepthImage image = smallImage();
  const sensor_msgs::PointCloud2 cloud = toOrganisedCloud(image, k, someHeader());
  ASSERT_EQ(cloud.width, 3u);
  ASSERT_EQ(cloud.height, 2u);
  ASSERT_EQ(cloud.row_step, 3u * cloud.point_step);
  ASSERT_EQ(cloud.data.size(), 2u * cloud.row_step);
  EXPECT_FALSE(cloud.is_dense);
  sensor_msgs::PointCloud2ConstIterator<float> x(cloud, "x"), y(cloud, "y"), z(cloud, "z");
  for (int v = 0; v < 2; ++v) {
    for (int u = 0; u < 3; ++u, ++x, ++y, ++z) {
      if (image.at(u, v) == 0.0f) {
        EXPECT_TRUE(std::isnan(*x) && std::isnan(*y) && std::isnan(*z));
        continue;
      }
      EXPECT_EQ(*z, image.at(u, v));
      EXPECT_NEAR(k.fx * *x / *z + k.cx, u, 1e-5);
      EXPECT_NEAR(k.fy * *y / *z + k.cy, v, 1e-5);
    }
  }
}

TEST(DepthMessages, CameraInfoIsAPinholeWithoutDistortion) {
  const sensor_msgs::CameraInfo info = toCameraInfo({640, 480, 525.0, 526.0, 319.5, 239.5}, someHeader());
  EXPECT_EQ(info.width, 640u);
  EXPECT_EQ(info.height, 480u);
  EXPECT_EQ(info.K[0], 525.0);
  EXPECT_EQ(info.K[4], 526.0);
  EXPECT_EQ(info.P[2], 319.5);
  EXPECT_EQ(info.P[6], 239.5);
  EXPECT_EQ(info.P[10], 1.0);
  for (const double d : info.D) EXPECT_EQ(d, 0.0);
}

}  // namespace
}  // namespace ttsdf
