// Real sensors' files, where the environment variable TTSDF_TEST_DATA names a folder that holds them.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "ttsdf_localization/frames/frame_folder.h"
#include "ttsdf_localization/fusion/tsdf_volume.h"

namespace ttsdf {
namespace {

std::string dataFolder(const std::string& name) {
  const char* root = std::getenv("TTSDF_TEST_DATA");
  if (!root) return {};
  const std::filesystem::path path = std::filesystem::path(root) / name;
  return std::filesystem::exists(path) ? path.string() : std::string();
}

#define SKIP_WITHOUT(folder) \
  if ((folder).empty()) GTEST_SKIP() << "TTSDF_TEST_DATA is not set or lacks the data"

double validShare(const DepthImage& image) {
  std::size_t valid = 0;
  for (const float depth : image.depth) valid += depth > 0.0F;
  return static_cast<double>(valid) / static_cast<double>(image.depth.size());
}

TEST(RealFrames, KinectRoomFusesToItsKnownSize) {
  const std::string path = dataFolder("redkitchen");
  SKIP_WITHOUT(path);
  const FrameFolder folder(path);
  EXPECT_EQ(folder.frames().size(), 1000U);
  EXPECT_EQ(folder.intrinsics().width, 640);
  EXPECT_EQ(folder.intrinsics().height, 480);
  const auto frames = folder.select(100, 0);
  ASSERT_EQ(frames.size(), 10U);
  TsdfVolume volume;
  for (const FrameEntry& frame : frames)
    volume.integrate(folder.depth(frame), folder.intrinsics(), folder.pose(frame));
  EXPECT_FALSE(volume.empty());
  EXPECT_LT(volume.memoryBytes(), 60U << 20U);

  // 65535 is no reading: frame 33 has 46 of them.
  const DepthImage image = folder.depth(folder.select(1000, 33).front());
  for (const float depth : image.depth) ASSERT_LT(depth, 4.0F);
}

TEST(RealFrames, RealSenseFolderWithOtherIntrinsicsFile) {
  const std::string path = dataFolder("realsense_tabletop");
  SKIP_WITHOUT(path);
  const FrameFolder folder(path);
  EXPECT_EQ(folder.frames().size(), 50U);
  EXPECT_NEAR(folder.intrinsics().fx, 615.195, 1e-3);
  EXPECT_NEAR(validShare(folder.depth(folder.frames().front())), 0.36, 0.15);
  FusionOptions options;
  options.voxel_size = 0.005, options.truncation = 0.02;
  TsdfVolume volume(options);
  for (const FrameEntry& frame : folder.select(10, 5)) {
    volume.integrate(folder.depth(frame), folder.intrinsics(), folder.pose(frame));
  }
  EXPECT_FALSE(volume.empty());
}

TEST(RealFrames, BigEndianPgm) {
  const std::string path = dataFolder("mini_sequences/slambook2_ch5/depth");
  SKIP_WITHOUT(path);
  const DepthImage image = readDepthImage(path + "/1.pgm", 1000.0);
  EXPECT_EQ(image.width, 640);
  EXPECT_EQ(image.height, 480);
  EXPECT_FLOAT_EQ(image.at(320, 240), 2.799F);  // 0x0AEF
}

}  // namespace
}  // namespace ttsdf
