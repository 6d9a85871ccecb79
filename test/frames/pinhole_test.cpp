// Depth images back from organised clouds as depth_image_proc makes them.

#include "ttsdf_localization/frames/pinhole.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "../support/rendered_scene.h"

namespace ttsdf {
namespace {

CameraIntrinsics kinect() { return {640, 480, 585.3, 584.1, 320.7, 239.2}; }

DepthImage millimetreImage(const CameraIntrinsics& k) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> raw(300, 4000);
  DepthImage image;
  image.width = k.width, image.height = k.height;
  for (int i = 0; i < k.width * k.height; ++i) {
    image.depth.push_back(i % 7 == 0 ? 0.0F : static_cast<float>(raw(random)) * 0.001F);
  }
  return image;
}

/// The arithmetic of depth_image_proc's conversion, in single precision.
Eigen::Matrix3Xf cloudOf(const DepthImage& image, const CameraIntrinsics& k) {
  const auto cx = static_cast<float>(k.cx), cy = static_cast<float>(k.cy);
  const auto x_scale = static_cast<float>(1.0 / k.fx), y_scale = static_cast<float>(1.0 / k.fy);
  Eigen::Matrix3Xf points(3, static_cast<Eigen::Index>(image.depth.size()));
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      const float depth = image.at(u, v);
      auto point = points.col(static_cast<Eigen::Index>(v) * image.width + u);
      if (depth > 0.0F) {
        point << (static_cast<float>(u) - cx) * depth * x_scale,
            (static_cast<float>(v) - cy) * depth * y_scale, depth;
      } else {
        point.setConstant(NAN);
      }
    }
  }
  return points;
}

TEST(PinholeFromCloud, RecoversDepthBitForBitAndIntrinsics) {
  for (const double sign : {1.0, -1.0}) {
    CameraIntrinsics k = kinect();
    k.fy *= sign;
    const DepthImage image = millimetreImage(k);
    const auto recovered = pinholeFromCloud(cloudOf(image, k), k.width, k.height);
    ASSERT_TRUE(recovered);
    EXPECT_EQ(recovered->first.depth, image.depth);
    EXPECT_EQ(recovered->second.width, k.width);
    EXPECT_EQ(recovered->second.height, k.height);
    EXPECT_NEAR(recovered->second.fx, k.fx, 1e-6 * k.fx);
    EXPECT_NEAR(recovered->second.fy, k.fy, 1e-6 * std::abs(k.fy));
    EXPECT_NEAR(recovered->second.cx, k.cx, 1e-4);
    EXPECT_NEAR(recovered->second.cy, k.cy, 1e-4);
  }
}

TEST(PinholeFromCloud, GreatestRawValueIsNoReading) {
  const CameraIntrinsics k = kinect();
  DepthImage image = millimetreImage(k);
  const std::size_t pixel = 100 * 640 + 100;
  image.depth[pixel] = static_cast<float>(65535) * 0.001F;
  const auto recovered = pinholeFromCloud(cloudOf(image, k), k.width, k.height);
  ASSERT_TRUE(recovered);
  EXPECT_EQ(recovered->first.depth[pixel], 0.0F);
}

TEST(PinholeFromCloud, RefusesWhatIsNoPinholeImage) {
  const CameraIntrinsics k = kinect();
  const Eigen::Matrix3Xf good = cloudOf(millimetreImage(k), k);
  EXPECT_FALSE(pinholeFromCloud(good, k.width, k.height - 1));
  EXPECT_FALSE(pinholeFromCloud(good, k.width * k.height, 1));

  Eigen::Matrix3Xf turned = good;
  turned.row(0) = good.row(2), turned.row(1) = -good.row(0), turned.row(2) = -good.row(1);
  EXPECT_FALSE(pinholeFromCloud(turned, k.width, k.height));

  Eigen::Matrix3Xf moved = good;
  moved.row(0).array() += 0.05F;  // another frame than the camera's
  EXPECT_FALSE(pinholeFromCloud(moved, k.width, k.height));

  Eigen::Matrix3Xf one_off = good;
  one_off(0, 1000) += 0.01F;
  EXPECT_FALSE(pinholeFromCloud(one_off, k.width, k.height));

  Eigen::Matrix3Xf behind = good;
  behind.col(1000) *= -1.0F;
  EXPECT_FALSE(pinholeFromCloud(behind, k.width, k.height));

  Eigen::Matrix3Xf empty = good;
  empty.setConstant(NAN);
  EXPECT_FALSE(pinholeFromCloud(empty, k.width, k.height));
  empty.block(0, 100000, 3, 40) = good.block(0, 100000, 3, 40);
  EXPECT_FALSE(pinholeFromCloud(empty, k.width, k.height));
  EXPECT_FALSE(pinholeFromCloud(Eigen::Matrix3Xf(3, 0), 0, 0));
}

}  // namespace
}  // namespace ttsdf
