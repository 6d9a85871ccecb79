#pragma once
// The same views of a room, to be written in every layout.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <string>
#include <vector>

#include "../support/rendered_scene.h"
#include "../support/temp_folder.h"
#include "ttsdf_localization/frames/frame_check.h"
#include "ttsdf_localization/frames/frame_folder.h"

namespace ttsdf {

constexpr int kFrames = 12, kWidth = 64, kHeight = 48;

inline testing::Scene room() {
  return testing::Scene()
      .room({0, 0, 0}, {4, 3, 2.5})
      .box({1.0, 0.2, 0.0}, {1.6, 0.8, 0.9})
      .sphere({3.0, 2.2, 0.6}, 0.5);
}

/// Around the room and looking about, so that both turns and ways tell.
inline Eigen::Isometry3d poseOf(double n) {
  const double angle = 2.0 * 3.14159265358979 * n / kFrames;
  return testing::lookAt(
      {2.0 + 0.8 * std::cos(angle), 1.5 + 0.5 * std::sin(angle), 1.2 + 0.2 * std::sin(2 * angle)},
      {2.0 + 3.0 * std::cos(angle + 2.2), 1.5 + 3.0 * std::sin(angle + 2.2), 0.9});
}

inline void writePgm(const std::string& path, const DepthImage& image, double units) {
  std::ofstream out(path, std::ios::binary);
  out << "P5\n" << image.width << ' ' << image.height << "\n65535\n";
  for (const float z : image.depth) {
    const auto raw = static_cast<unsigned>(std::lround(static_cast<double>(z) * units));
    out.put(static_cast<char>(raw >> 8 & 255u)).put(static_cast<char>(raw & 255u));
  }
}

inline std::string matrixText(const Eigen::Matrix4d& m) {
  std::ostringstream out;
  out << std::setprecision(17);
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) out << m(row, column) << (column < 3 ? ' ' : '\n');
  }
  return out.str();
}

inline std::string quaternionText(const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q(T.linear());
  std::ostringstream out;
  out << std::setprecision(17) << T.translation().transpose() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z()
      << ' ' << q.w();
  return out.str();
}

class Layouts : public ::testing::Test {
 protected:
  Layouts() : camera_(testing::camera(kWidth, kHeight)) {
    for (int n = 0; n < kFrames; ++n) images_.push_back(testing::render(room(), camera_, poseOf(n)));
  }
  std::string file(const std::string& name) {
    const std::string path = folder_.file(name);
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    return path;
  }
  void write(const std::string& name, const std::string& text) {
    std::ofstream(file(name), std::ios::binary) << text;
  }
  std::string cameraText(int size) const {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m(0, 0) = camera_.fx, m(1, 1) = camera_.fy, m(0, 2) = camera_.cx, m(1, 2) = camera_.cy;
    std::ostringstream out;
    out << std::setprecision(17) << m.topLeftCorner(size, size) << '\n';
    return out.str();
  }
  static std::string number(int n, int digits) {
    std::ostringstream out;
    out << std::setw(digits) << std::setfill('0') << n;
    return out.str();
  }
  /// 7-Scenes, with poses and depths as the two functions have them.
  template <class Pose>
  void writeScenes(const Pose& pose, double units = 1000.0) {
    for (int n = 0; n < kFrames; ++n) {
      const std::string name = "frame-" + number(n, 6);
      writePgm(file(name + ".depth.pgm"), images_[static_cast<std::size_t>(n)], units);
      write(name + ".pose.txt", matrixText(pose(poseOf(n)).matrix()));
    }
    write("camera-intrinsics.txt", cameraText(3));
  }
  void expectFrames(const std::string& layout, double units, std::size_t count = kFrames) {
    const FrameFolder folder(folder_.path(), FrameFolderOptions());
    EXPECT_EQ(folder.layout(), layout);
    EXPECT_NE(folder.description().find(layout), std::string::npos);
    EXPECT_EQ(folder.unitsPerMetre(), units);
    ASSERT_EQ(folder.frames().size(), count);
    EXPECT_EQ(folder.intrinsics().width, kWidth);
    EXPECT_NEAR(folder.intrinsics().fx, camera_.fx, 1e-9);
    EXPECT_NEAR(folder.intrinsics().cy, camera_.cy, 1e-9);
    for (const FrameEntry& frame : folder.frames()) {
      EXPECT_LT((folder.pose(frame).matrix() - poseOf(frame.index).matrix()).cwiseAbs().maxCoeff(), 1e-9);
      const DepthImage image = folder.depth(frame);
      EXPECT_NEAR(image.at(20, 30), images_[static_cast<std::size_t>(frame.index)].at(20, 30), 1.0 / units);
    }
    const FrameCheck check = checkFrames(folder, FrameFolderOptions(), folder.frames());
    EXPECT_EQ(check.verdict(), FrameCheck::Verdict::kGood) << layout << ": " << check.message();
  }
  /// What is said about the folder as it is.
  FrameCheck check(const FrameFolderOptions& options = {}) {
    const FrameFolder folder(folder_.path(), options);
    return checkFrames(folder, options, folder.frames());
  }
  void expectAdvice(const std::string& advice) {
    const FrameCheck found = check();
    EXPECT_EQ(found.verdict(), FrameCheck::Verdict::kNonsense) << found.message();
    EXPECT_NE(found.message().find(advice), std::string::npos) << found.message();
  }

  testing::TempFolder folder_;
  CameraIntrinsics camera_;
  std::vector<DepthImage> images_;
};

}  // namespace ttsdf
