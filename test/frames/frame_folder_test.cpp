// Depth images, poses and folders of them: what is read, and every way in which they can be broken.

#include "ttsdf_localization/frames/frame_folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vigra/impex.hxx>
#include <vigra/multi_array.hxx>

#include "../support/temp_folder.h"

namespace ttsdf {
namespace {

using testing::TempFolder;
using testing::thrownMessage;

constexpr int kWidth = 8, kHeight = 6;
const char kIdentity[] = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
const char kIntrinsics[] = "7.5 0 4\n0 7.5 3\n0 0 1\n";

/// raw(u, v) = 1000 + 10 v + u, with 0 and 65535 at the first two pixels.
std::string writeImage(const std::string& path) {
  vigra::MultiArray<2, vigra::UInt16> pixels(vigra::Shape2(kWidth, kHeight));
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) pixels(u, v) = static_cast<vigra::UInt16>(1000 + 10 * v + u);
  }
  pixels(0, 0) = 0, pixels(1, 0) = 65535;
  vigra::exportImage(pixels, vigra::ImageExportInfo(path.c_str()).setPixelType("UINT16"));
  return path;
}

void expectImage(const DepthImage& image) {
  ASSERT_EQ(image.width, kWidth);
  ASSERT_EQ(image.height, kHeight);
  EXPECT_EQ(image.at(0, 0), 0.0F);
  EXPECT_EQ(image.at(1, 0), 0.0F);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = v == 0 ? 2 : 0; u < kWidth; ++u) {
      EXPECT_EQ(image.at(u, v),
                static_cast<float>(1000 + 10 * v + u) * 0.001F);  // as depth_image_proc computes it
    }
  }
}

std::string readError(const std::string& path) {
  return thrownMessage<std::runtime_error>([&] { readDepthImage(path, 1000.0); });
}

#define EXPECT_NAMES_FILE(message, path) EXPECT_NE((message).find(path), std::string::npos) << (message)

TEST(DepthImage, ReadsSixteenBitPng) {
  const TempFolder folder;
  expectImage(readDepthImage(writeImage(folder.file("a.png")), 1000.0));
  EXPECT_FLOAT_EQ(readDepthImage(folder.file("a.png"), 5000.0).at(2, 0), 1002.0F / 5000.0F);
}

TEST(DepthImage, ReadsBinaryPgmWithComments) {
  const TempFolder folder;
  std::string content = "P5\n# a comment\n8 # another\n6\n65535\n";
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const int raw = u == 0 && v == 0 ? 0 : u == 1 && v == 0 ? 65535 : 1000 + 10 * v + u;
      content += static_cast<char>(raw >> 8), content += static_cast<char>(raw & 255);
    }
  }
  expectImage(readDepthImage(folder.write("a.pgm", content), 1000.0));

  for (const std::size_t length : {std::size_t{3}, std::size_t{12}, std::size_t{30}, content.size() - 1}) {
    const std::string path = folder.write("cut.pgm", content.substr(0, length));
    EXPECT_NAMES_FILE(readError(path), path);
  }
}

TEST(DepthImage, TruncatedOrDamagedPngIsAnErrorThatNamesTheFile) {
  const TempFolder folder;
  const std::string content = testing::fileContent(writeImage(folder.file("good.png")));
  for (std::size_t length = 0; length + 12 < content.size(); ++length) {  // the last 12 bytes hold no pixel
    const std::string path = folder.write("cut.png", content.substr(0, length));
    EXPECT_NAMES_FILE(readError(path), path);
  }
  std::string damaged = content;
  damaged[content.size() / 2] = static_cast<char>(~damaged[content.size() / 2]);
  const std::string path = folder.write("damaged.png", damaged);
  EXPECT_NAMES_FILE(readError(path), path);
}

TEST(DepthImage, OtherFilesAreErrorsThatNameTheFile) {
  const TempFolder folder;
  vigra::MultiArray<2, vigra::UInt8> grey(vigra::Shape2(4, 4));
  vigra::exportImage(grey, vigra::ImageExportInfo(folder.file("grey8.png").c_str()));
  vigra::MultiArray<2, vigra::RGBValue<vigra::UInt8>> colour(vigra::Shape2(4, 4));
  vigra::exportImage(colour, vigra::ImageExportInfo(folder.file("colour.png").c_str()));
  folder.write("text.png", "this is no image at all\n");
  folder.write("ascii.pgm", "P2\n2 1\n65535\n1000 2000\n");
  folder.write("huge.pgm", "P5\n99999999 99999999\n65535\n");
  folder.write("bytes.pgm", "P5\n2 1\n255\nab");
  for (const char* name :
       {"grey8.png", "colour.png", "text.png", "ascii.pgm", "huge.pgm", "bytes.pgm", "missing.png", "."}) {
    const std::string path = folder.file(name);
    EXPECT_NAMES_FILE(readError(path), path);
  }
  EXPECT_NE(readError(folder.file("grey8.png")).find("16-bit"), std::string::npos);
  EXPECT_THROW(readDepthImage(writeImage(folder.file("a.png")), 0.0), std::invalid_argument);
  EXPECT_THROW(readDepthImage(folder.file("a.png"), std::nan("")), std::invalid_argument);
}

TEST(ToPoints, UsesPinholeAndRangeAndStride) {
  DepthImage image{4, 3, {0.0F, 1.0F, 2.0F, 9.0F, NAN, 1.5F, 2.0F, 0.1F, 1.0F, 1.0F, 1.0F, 1.0F}};
  const CameraIntrinsics k{4, 3, 2.0, -4.0, 1.0, 1.0};
  const Eigen::Matrix3Xf points = toPoints(image, k, 1, 0.2, 4.0);
  ASSERT_EQ(points.cols(), 8);
  EXPECT_TRUE(points.col(0).isApprox(Eigen::Vector3f(0.0F, 0.25F, 1.0F)));    // (1, 0), fy < 0
  EXPECT_TRUE(points.col(1).isApprox(Eigen::Vector3f(1.0F, 0.5F, 2.0F)));     // (2, 0)
  EXPECT_TRUE(points.col(4).isApprox(Eigen::Vector3f(-0.5F, -0.25F, 1.0F)));  // (0, 2)
  EXPECT_EQ(toPoints(image, k, 2, 0.2, 4.0).cols(), 3);                       // (2, 0), (0, 2), (2, 2)
  EXPECT_EQ(toPoints(image, k, 1, 0.0, 100.0).cols(), 10);  // zero is no reading whatever the range
  EXPECT_THROW(toPoints(image, k, 0, 0.2, 4.0), std::invalid_argument);
  CameraIntrinsics other = k;
  other.width = 5;
  EXPECT_THROW(toPoints(image, other, 1, 0.2, 4.0), std::invalid_argument);
}

TEST(Pose, IsReorthonormalised) {
  const TempFolder folder;
  const Eigen::Quaterniond rotation = Eigen::Quaterniond(0.9, 0.1, -0.3, 0.2).normalized();
  Eigen::Matrix4d rough = Eigen::Matrix4d::Identity();
  rough.topLeftCorner<3, 3>() = 0.9995 * rotation.toRotationMatrix();  // as in 7-Scenes: det 0.9985
  rough.topRightCorner<3, 1>() << 1.0, -2.0, 3.5;
  std::ostringstream text;
  text.precision(17);
  text << rough;
  const Eigen::Isometry3d pose = readPose(folder.write("a.txt", text.str()));
  EXPECT_LE((pose.linear() - rotation.toRotationMatrix()).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(pose.translation(), Eigen::Vector3d(1.0, -2.0, 3.5));

  writePose(folder.file("b.txt"), pose);
  EXPECT_LE((readPose(folder.file("b.txt")).matrix() - pose.matrix()).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_THROW(writePose(folder.file("no/such/folder.txt"), pose), std::runtime_error);
}

TEST(Pose, BrokenPosesAreErrorsThatNameTheFile) {
  const TempFolder folder;
  const char* broken[] = {
      "",
      "1 0 0 0 0 1 0 0 0 0 1",
      "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 7",
      "nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1",
      "1 0 0 inf 0 1 0 0 0 0 1 0 0 0 0 1",
      "1 0 0 0 0 1 0 zero 0 0 1 0 0 0 0 1",
      "1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1",
      "2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1",
      "0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 1",
  };
  for (const char* content : broken) {
    const std::string path = folder.write("pose.txt", content);
    const std::string message = thrownMessage<std::runtime_error>([&] { readPose(path); });
    EXPECT_NAMES_FILE(message, path);
  }
  EXPECT_THROW(readPose(folder.file("missing.txt")), std::runtime_error);
}

class FrameFolderTest : public ::testing::Test {
 protected:
  void addFrame(int index, bool with_pose = true) {
    char name[64];
    std::snprintf(name, sizeof(name), "frame-%06d", index);
    writeImage(folder_.file(std::string(name) + ".depth.png"));
    if (with_pose) folder_.write(std::string(name) + ".pose.txt", kIdentity);
  }
  std::string openError() {
    return thrownMessage<std::runtime_error>([&] { FrameFolder opened(folder_.path()); });
  }
  TempFolder folder_;
};

TEST_F(FrameFolderTest, ListsFramesWithPosesInOrder) {
  for (const int index : {30, 0, 10, 25, 5}) addFrame(index);
  addFrame(20, false);
  folder_.write("frame-000040.color.png", "ignored");
  folder_.write("frame-x.depth.png", "ignored");
  folder_.write("camera-intrinsics.txt", kIntrinsics);
  const FrameFolder opened(folder_.path());
  std::vector<int> indices;
  for (const auto& frame : opened.frames()) indices.push_back(frame.index);
  EXPECT_EQ(indices, (std::vector<int>{0, 5, 10, 25, 30}));
  EXPECT_EQ(opened.intrinsics().width, kWidth);
  EXPECT_EQ(opened.intrinsics().height, kHeight);
  EXPECT_EQ(opened.intrinsics().fx, 7.5);
  EXPECT_EQ(opened.intrinsics().cy, 3.0);
  ASSERT_EQ(opened.select(10, 5).size(), 2U);
  EXPECT_EQ(opened.select(10, 5)[1].index, 25);
  EXPECT_EQ(opened.select(1, 0).size(), 5U);
  expectImage(opened.depth(opened.frames()[1]));
  EXPECT_EQ(opened.pose(opened.frames()[1]).matrix(), Eigen::Matrix4d::Identity());
  EXPECT_THROW(opened.select(0, 0), std::invalid_argument);
  EXPECT_THROW(opened.select(10, 10), std::invalid_argument);
  EXPECT_THROW(opened.select(10, -1), std::invalid_argument);
}

TEST_F(FrameFolderTest, OtherIntrinsicsNameAndNegativeFocalLength) {
  addFrame(0);
  folder_.write("intrinsics.K.txt", "6.1 0 4\r\n0 -6 3\r\n0 0 1\r\n");
  EXPECT_EQ(FrameFolder(folder_.path()).intrinsics().fy, -6.0);
}

TEST_F(FrameFolderTest, UnreadableFirstImageDoesNotHideTheSize) {
  for (const int index : {0, 1}) addFrame(index);
  folder_.write("frame-000000.depth.png", "broken");
  folder_.write("camera-intrinsics.txt", kIntrinsics);
  const FrameFolder opened(folder_.path());
  EXPECT_EQ(opened.intrinsics().width, kWidth);
  EXPECT_THROW(opened.depth(opened.frames()[0]), std::runtime_error);
  expectImage(opened.depth(opened.frames()[1]));
}

TEST_F(FrameFolderTest, WhatIsMissingIsSaid) {
  EXPECT_NE(thrownMessage<std::runtime_error>([] {
              FrameFolder opened("/no/such/folder");
            }).find("/no/such/folder"),
            std::string::npos);
  EXPECT_NE(openError().find("depth.png"), std::string::npos);
  addFrame(0, false);
  EXPECT_NE(openError().find("pose.txt"), std::string::npos);
  addFrame(0);
  EXPECT_NE(openError().find("intrinsics"), std::string::npos);
  for (const char* bad :
       {"585 0 320 0 585 240", "585 0 320 0 nan 240 0 0 1", "0 0 320 0 585 240 0 0 1", "a b c"}) {
    folder_.write("camera-intrinsics.txt", bad);
    EXPECT_NE(openError().find("camera-intrinsics.txt"), std::string::npos) << bad;
  }
  folder_.write("camera-intrinsics.txt", kIntrinsics);
  folder_.write("frame-000000.depth.png", "broken");
  EXPECT_NE(openError().find("frame-000000.depth.png"), std::string::npos);
}

}  // namespace
}  // namespace ttsdf
