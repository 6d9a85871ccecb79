// Depth images: parts of the sensor, binned, compressed, damaged.

#include "ros/messages/depth_conversion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>

#include "depth_samples.h"

namespace ttsdf {
namespace {

using namespace test;

void expectOnTheWall(const ScanPoints& points, double tolerance) {
  ASSERT_GT(points.cols(), 100);
  for (Eigen::Index n = 0; n < points.cols(); ++n)
    EXPECT_NEAR(points(2, n) - 0.3F * points(0, n) + 0.2F * points(1, n), 2.0F, tolerance);
}

TEST(DepthConversion, PointsLieOnTheWall) {
  expectOnTheWall(convertDepth(depthImage(0, 0, kDepthWidth, kDepthHeight, 1), depthInfo(), {}).points, 1e-5);
  expectOnTheWall(convertDepth(depthImage(0, 0, kDepthWidth, kDepthHeight, 1, true), depthInfo(), {}).points,
                  1e-3);
  sensor_msgs::CameraInfo only_k = depthInfo();
  only_k.P.assign(0.0);
  expectOnTheWall(convertDepth(depthImage(0, 0, kDepthWidth, kDepthHeight, 1), only_k, {}).points, 1e-5);
}

TEST(DepthConversion, ARegionOfInterestAndBinningMoveTheCamera) {
  sensor_msgs::CameraInfo info = depthInfo();
  info.roi.x_offset = 20;
  info.roi.y_offset = 10;
  info.roi.width = 40;
  info.roi.height = 30;
  expectOnTheWall(convertDepth(depthImage(20, 10, 40, 30, 1), info, {}).points, 1e-5);
  info.binning_x = info.binning_y = 2;
  expectOnTheWall(convertDepth(depthImage(20, 10, 20, 15, 2), info, {}).points, 1e-5);
  info.roi = sensor_msgs::RegionOfInterest();
  expectOnTheWall(convertDepth(depthImage(0, 0, 40, 30, 2), info, {}).points, 1e-5);
  info.binning_x = 3;
  EXPECT_THROW(convertDepth(depthImage(0, 0, 40, 30, 2), info, {}), std::invalid_argument);
}

/// A part of a larger image whose driver corrects the principal point, and says nothing of a region of
/// interest.
TEST(DepthConversion, ACropMayHaveItsPrincipalPointFarOutside) {
  constexpr std::uint32_t kCut = 8;  // columns that are left, at the right end
  const sensor_msgs::Image strip = depthImage(kDepthWidth - kCut, 0, kCut, kDepthHeight, 1);
  sensor_msgs::CameraInfo info = depthInfo();
  info.width = kCut;
  info.P[2] = info.K[2] = depthInfo().P[2] - (kDepthWidth - kCut);
  EXPECT_LT(info.P[2], -3.0 * kCut);
  expectOnTheWall(convertDepth(strip, info, {}).points, 1e-5);

  sensor_msgs::CameraInfo kinect = depthInfo();
  kinect.width = 64;
  kinect.height = 480;
  kinect.P[0] = kinect.P[5] = 525.0;
  kinect.P[2] = -256.0;
  kinect.P[6] = 240.0;
  sensor_msgs::Image image;
  image.width = 64;
  image.height = 480;
  image.encoding = "16UC1";
  image.step = 128;
  image.data.assign(128 * 480, 0);
  EXPECT_NO_THROW(convertDepth(image, kinect, {}));
  for (const double nonsense : {1e300, -1e300, 1e5, -1e5}) {
    kinect.P[2] = nonsense;
    EXPECT_THROW(convertDepth(image, kinect, {}), std::invalid_argument) << nonsense;
  }
}

TEST(DepthConversion, OtherByteOrderAndPaddedRowsAreRead) {
  sensor_msgs::Image padded = depthImage(0, 0, kDepthWidth, kDepthHeight, 1);
  sensor_msgs::Image other = padded;
  other.is_bigendian = !other.is_bigendian;
  for (std::size_t n = 0; n < other.data.size(); n += 4) std::reverse(&other.data[n], &other.data[n] + 4);
  expectOnTheWall(convertDepth(other, depthInfo(), {}).points, 1e-5);
  std::vector<std::uint8_t> rows;
  for (std::uint32_t v = 0; v < kDepthHeight; ++v) {
    rows.insert(rows.end(), padded.data.begin() + v * padded.step,
                padded.data.begin() + (v + 1) * padded.step);
    if (v + 1 < kDepthHeight) rows.insert(rows.end(), 13, 0xFF);  // the last row may end with its last pixel
  }
  padded.data = rows;
  padded.step += 13;
  expectOnTheWall(convertDepth(padded, depthInfo(), {}).points, 1e-5);
}

TEST(DepthConversion, BadImagesAreRefused) {
  const sensor_msgs::Image good = depthImage(0, 0, kDepthWidth, kDepthHeight, 1);
  sensor_msgs::Image bad = good;
  bad.data.resize(bad.data.size() - 1);
  EXPECT_THROW(convertDepth(bad, depthInfo(), {}), std::invalid_argument);
  bad = good;
  bad.encoding = "rgb8";
  EXPECT_THROW(convertDepth(bad, depthInfo(), {}), std::invalid_argument);
  bad = good;
  bad.width = bad.height = bad.step = 0xFFFFFFFF;
  EXPECT_THROW(convertDepth(bad, depthInfo(), {}), std::invalid_argument);
  sensor_msgs::CameraInfo info = depthInfo();
  info.P[0] = info.K[0] = -1.0;
  EXPECT_THROW(convertDepth(good, info, {}), std::invalid_argument);
  EXPECT_EQ(convertDepth(sensor_msgs::Image(good), depthInfo(), {}).not_finite, 0);
  bad = good;
  bad.width = bad.height = 0;
  EXPECT_EQ(convertDepth(bad, depthInfo(), {}).points.cols(), 0);
}

TEST(CompressedDepth, GivesTheImageBack) {
  const auto values = depthMillimetres();
  for (const auto& message : {compressedPng(values, "16UC1"), compressedRvl(values)}) {
    const sensor_msgs::Image image = decompressDepth(message);
    EXPECT_EQ(image.encoding, "16UC1");
    ASSERT_EQ(image.data.size(), 2 * values.size());
    EXPECT_EQ(std::memcmp(image.data.data(), values.data(), image.data.size()), 0);
    expectOnTheWall(convertDepth(image, depthInfo(), {}).points, 1e-3);
  }
}

TEST(CompressedDepth, InverseDepthOfMetresIsUndone) {
  const float a = 10000.0F, b = 100.0F;  // value = a / depth + b
  std::vector<std::uint16_t> values;
  for (std::uint32_t v = 0; v < kDepthHeight; ++v) {
    for (std::uint32_t u = 0; u < kDepthWidth; ++u)
      values.push_back(static_cast<std::uint16_t>(a / static_cast<float>(depthOf(u, v)) + b + 0.5F));
  }
  values[7] = 0;
  const sensor_msgs::Image image = decompressDepth(compressedPng(values, "32FC1", a, b));
  EXPECT_EQ(image.encoding, "32FC1");
  const ConvertedCloud converted = convertDepth(image, depthInfo(), {});
  EXPECT_EQ(converted.not_finite, 1);
  expectOnTheWall(converted.points, 2e-3);
}

TEST(CompressedDepth, DamagedMessagesAreRefusedAndNeverRead) {
  std::mt19937 random(7);
  for (const auto& good : {compressedPng(depthMillimetres(), "16UC1"), compressedRvl(depthMillimetres())}) {
    // The last bytes hold no pixel.
    for (std::size_t size = 0; size + 40 < good.data.size(); size += 1 + good.data.size() / 200) {
      sensor_msgs::CompressedImage cut = good;
      cut.data.resize(size);
      EXPECT_THROW(decompressDepth(cut), std::invalid_argument) << size;
    }
    for (int n = 0; n < 500; ++n) {
      sensor_msgs::CompressedImage bad = good;
      bad.data[random() % bad.data.size()] = static_cast<std::uint8_t>(random());
      try {
        decompressDepth(bad);
      } catch (const std::invalid_argument&) {
      }
    }
  }
  sensor_msgs::CompressedImage jpeg;
  jpeg.format = "bgr8; jpeg compressed bgr8";
  jpeg.data.resize(100);
  EXPECT_THROW(decompressDepth(jpeg), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
