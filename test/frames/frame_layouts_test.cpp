// Every layout of frame folders, written here around the same views of a room, and the mistakes that people
// make with them.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iomanip>
#include <sstream>

#include "../support/rendered_scene.h"
#include "../support/temp_folder.h"
#include "ttsdf_localization/frames/frame_check.h"
#include "ttsdf_localization/frames/frame_folder.h"

namespace ttsdf {
namespace {

using testing::TempFolder;
using testing::thrownMessage;

constexpr int kFrames = 12, kWidth = 64, kHeight = 48;

testing::Scene room() {
  return testing::Scene()
      .room({0, 0, 0}, {4, 3, 2.5})
      .box({1.0, 0.2, 0.0}, {1.6, 0.8, 0.9})
      .sphere({3.0, 2.2, 0.6}, 0.5);
}

/// Around the room and looking about, so that both turns and ways tell.
Eigen::Isometry3d poseOf(double n) {
  const double angle = 2.0 * 3.14159265358979 * n / kFrames;
  return testing::lookAt(
      {2.0 + 0.8 * std::cos(angle), 1.5 + 0.5 * std::sin(angle), 1.2 + 0.2 * std::sin(2 * angle)},
      {2.0 + 3.0 * std::cos(angle + 2.2), 1.5 + 3.0 * std::sin(angle + 2.2), 0.9});
}

void writePgm(const std::string& path, const DepthImage& image, double units) {
  std::ofstream out(path, std::ios::binary);
  out << "P5\n" << image.width << ' ' << image.height << "\n65535\n";
  for (const float z : image.depth) {
    const auto raw = static_cast<unsigned>(std::lround(static_cast<double>(z) * units));
    out.put(static_cast<char>(raw >> 8 & 255u)).put(static_cast<char>(raw & 255u));
  }
}

std::string matrixText(const Eigen::Matrix4d& m) {
  std::ostringstream out;
  out << std::setprecision(17);
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) out << m(row, column) << (column < 3 ? ' ' : '\n');
  }
  return out.str();
}

std::string quaternionText(const Eigen::Isometry3d& T) {
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

  TempFolder folder_;
  CameraIntrinsics camera_;
  std::vector<DepthImage> images_;
};

TEST_F(Layouts, SevenScenesWithThreeByThreeAndFourByFourIntrinsics) {
  writeScenes([](const Eigen::Isometry3d& T) { return T; });
  expectFrames("7-Scenes / 3DMatch", 1000.0);
  write("camera-intrinsics.txt", cameraText(4));
  expectFrames("7-Scenes / 3DMatch", 1000.0);
}

TEST_F(Layouts, BundleFusion) {
  writeScenes([](const Eigen::Isometry3d& T) { return T; }, 2000.0);
  std::filesystem::remove(folder_.file("camera-intrinsics.txt"));
  std::string intrinsics = cameraText(4);
  for (char& c : intrinsics) c = c == '\n' ? ' ' : c;
  write("info.txt",
        "m_versionNumber = 4\nm_depthWidth = 64\nm_depthHeight = 48\nm_depthShift = 2000\n"
        "m_calibrationDepthIntrinsic = " +
            intrinsics + "\nm_frames.size = 12\n");
  expectFrames("BundleFusion", 2000.0);
}

TEST_F(Layouts, ScanNet) {
  for (int n = 0; n < kFrames; ++n) {
    writePgm(file("depth/" + std::to_string(n) + ".pgm"), images_[static_cast<std::size_t>(n)], 1000.0);
    write("pose/" + std::to_string(n) + ".txt", matrixText(poseOf(n).matrix()));
  }
  write("intrinsic/intrinsic_depth.txt", cameraText(4));
  expectFrames("ScanNet", 1000.0);
  write("pose/3.txt", "-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n");
  const FrameFolder folder(folder_.path(), FrameFolderOptions());
  EXPECT_NE(thrownMessage<std::runtime_error>([&] { folder.pose(folder.frames()[3]); }).find("3.txt"),
            std::string::npos);
}

TEST_F(Layouts, TumWithInterpolatedPoses) {
  std::string list = "# timestamp filename\n", truth = "# timestamp tx ty tz qx qy qz qw\n";
  for (int n = 0; n < kFrames; ++n) {
    const std::string name = "depth/" + std::to_string(100 + n) + ".pgm";
    writePgm(file(name), images_[static_cast<std::size_t>(n)], 5000.0);
    list += std::to_string(100.0 + n) + " " + name + "\n";
  }
  // Poses on a straight way between those of the frames, at stamps of their own; the last frame has none.
  for (int n = 0; n + 1 < kFrames; ++n) {
    truth += std::to_string(100.0 + n) + " " + quaternionText(poseOf(n)) + "\n";
  }
  write("depth.txt", list);
  write("groundtruth.txt", truth);
  write("camera-intrinsics.txt", cameraText(3));
  expectFrames("TUM RGB-D", 5000.0, kFrames - 1);

  // Between two poses: half of the way and of the turn.
  FrameFolderOptions half;
  half.stamp_shift = 0.5;
  const FrameFolder folder(folder_.path(), half);
  const Eigen::Isometry3d T = folder.pose(folder.frames()[2]), a = poseOf(2), b = poseOf(3);
  EXPECT_LT((T.translation() - 0.5 * (a.translation() + b.translation())).norm(), 1e-9);
  EXPECT_NEAR(Eigen::AngleAxisd(a.linear().transpose() * T.linear()).angle(),
              Eigen::AngleAxisd(T.linear().transpose() * b.linear()).angle(), 1e-9);
}

TEST_F(Layouts, RedwoodIclReplicaAndLists) {
  std::string log, freiburg, lines, list;
  for (int n = 0; n < kFrames; ++n) {
    writePgm(file("depth/" + number(n, 5) + ".pgm"), images_[static_cast<std::size_t>(n)], 1000.0);
    log += std::to_string(n) + " " + std::to_string(n) + " " + std::to_string(n + 1) + "\n" +
           matrixText(poseOf(n).matrix());
    freiburg += std::to_string(n) + " " + quaternionText(poseOf(n)) + "\n";
    list += quaternionText(poseOf(n)) + "\n";
    std::string row = matrixText(poseOf(n).matrix());
    for (char& c : row) c = c == '\n' ? ' ' : c;
    lines += row + "\n";
  }
  write("trajectory.log", log);
  std::ostringstream json;
  json << std::setprecision(17) << "{\"width\": 64, \"height\": 48, \"intrinsic_matrix\": [" << camera_.fx
       << ", 0, 0, 0, " << camera_.fy << ", 0, " << camera_.cx << ", " << camera_.cy << ", 1]}";
  write("camera_intrinsic.json", json.str());
  expectFrames("Redwood / Open3D", 1000.0);

  std::filesystem::remove(folder_.file("trajectory.log"));
  write("pose.txt", list);
  expectFrames("depth images with a list of poses", 1000.0);

  std::filesystem::remove(folder_.file("pose.txt"));
  write("livingRoom0.gt.freiburg", freiburg);
  for (int n = 0; n < kFrames; ++n) {
    writePgm(file("depth/" + number(n, 5) + ".pgm"), images_[static_cast<std::size_t>(n)], 5000.0);
  }
  expectFrames("ICL-NUIM", 5000.0);

  std::filesystem::remove_all(folder_.file("depth"));
  std::filesystem::remove(folder_.file("livingRoom0.gt.freiburg"));
  write("traj.txt", lines);
  for (int n = 0; n < kFrames; ++n) {
    writePgm(file("results/depth" + number(n, 6) + ".pgm"), images_[static_cast<std::size_t>(n)], 6553.5);
  }
  expectFrames("Replica", 6553.5);
}

TEST_F(Layouts, CloudsWithPoses) {
  std::string lines;
  for (int n = 0; n < kFrames; ++n) {
    write("cloud/" + number(n, 6) + ".xyz", "1 0 2\n");
    std::string row = matrixText(poseOf(n).matrix());
    for (char& c : row) c = c == '\n' ? ' ' : c;
    lines += row.substr(0, row.rfind("0 0 0 1")) + "\n";  // KITTI has three rows
  }
  const auto expectClouds = [this] {
    const FrameFolder folder(folder_.path(), FrameFolderOptions());
    EXPECT_TRUE(folder.holdsClouds());
    ASSERT_EQ(folder.frames().size(), static_cast<std::size_t>(kFrames));
    EXPECT_LT((folder.pose(folder.frames()[5]).matrix() - poseOf(5).matrix()).cwiseAbs().maxCoeff(), 1e-9);
  };
  EXPECT_NE(thrownMessage<std::runtime_error>([this] {
              FrameFolder(folder_.path(), FrameFolderOptions());
            }).find("none with a pose"),
            std::string::npos);
  write("poses.txt", lines);
  expectClouds();
  for (int n = 0; n < kFrames; ++n) write("pose/" + number(n, 6) + ".txt", matrixText(poseOf(n).matrix()));
  expectClouds();
  for (int n = 0; n < kFrames; ++n) {
    write("frame-" + number(n, 6) + ".pcd", "x");
    write("frame-" + number(n, 6) + ".pose.txt", matrixText(poseOf(n).matrix()));
  }
  expectClouds();
}

TEST_F(Layouts, IntrinsicsOfAnotherSizeAreScaledWhereTheirSizeIsKnown) {
  writeScenes([](const Eigen::Isometry3d& T) { return T; });
  std::filesystem::remove(folder_.file("camera-intrinsics.txt"));
  std::ostringstream json;
  json << std::setprecision(17) << "{\"width\": 128, \"height\": 96, \"intrinsic_matrix\": ["
       << 2 * camera_.fx << ", 0, 0, 0, " << 2 * camera_.fy << ", 0, " << 2 * camera_.cx + 0.5 << ", "
       << 2 * camera_.cy + 0.5 << ", 1]}";
  write("intrinsic.json", json.str());
  expectFrames("7-Scenes / 3DMatch", 1000.0);
}

TEST_F(Layouts, OddImagesDoNotDecideTheSize) {
  writeScenes([](const Eigen::Isometry3d& T) { return T; });
  DepthImage small;
  small.width = 8, small.height = 6;
  small.depth.assign(48, 1.0F);
  writePgm(file("frame-000000.depth.pgm"), small, 1000.0);
  const FrameFolder folder(folder_.path(), FrameFolderOptions());
  EXPECT_EQ(folder.intrinsics().width, kWidth);
  EXPECT_NE(folder.description().find("1 images of other sizes"), std::string::npos) << folder.description();
}

TEST_F(Layouts, MistakesAreNamed) {
  const auto same = [](const Eigen::Isometry3d& T) { return T; };
  writeScenes([](const Eigen::Isometry3d& T) { return T.inverse(); });
  expectAdvice("--poses world-to-camera");
  FrameFolderOptions inverted;
  inverted.poses_world_to_camera = true;
  EXPECT_EQ(check(inverted).verdict(), FrameCheck::Verdict::kGood);

  Eigen::Isometry3d turn = Eigen::Isometry3d::Identity();
  turn.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
  writeScenes([&turn](const Eigen::Isometry3d& T) { return T * turn; });
  expectAdvice("--camera-axes opengl");
  writeScenes([](Eigen::Isometry3d T) {
    T.translation() *= 1000.0;
    return T;
  });
  expectAdvice("--pose-scale 0.001");
  writeScenes(same, 10000.0);
  expectAdvice("--depth-scale 10000");
  writeScenes(same, 100.0);
  expectAdvice("--depth-scale 100");
  writeScenes(same);
  write("camera-intrinsics.txt", "-57.6 0 31.5\n0 57.6 23.5\n0 0 1\n");
  expectAdvice("sign of fx");
  write("camera-intrinsics.txt", cameraText(3));
  EXPECT_EQ(check().verdict(), FrameCheck::Verdict::kGood);
}

TEST_F(Layouts, NonsenseIntrinsicsAreRefusedWithTheImageTheyWouldFit) {
  writeScenes([](const Eigen::Isometry3d& T) { return T; });
  const auto refusal = [this](const std::string& text) {
    write("camera-intrinsics.txt", text);
    return thrownMessage<std::runtime_error>([this] { FrameFolder(folder_.path(), FrameFolderOptions()); });
  };
  EXPECT_NE(refusal("0.001 0 31.5\n0 0.001 23.5\n0 0 1\n").find("fx 0.001"), std::string::npos);
  EXPECT_NE(refusal("57 0 1e300\n0 57 23.5\n0 0 1\n").find("principal point"), std::string::npos);
  EXPECT_NE(refusal("576 0 319.5\n0 576 239.5\n0 0 1\n").find("639 x 479"), std::string::npos);
  EXPECT_NE(refusal("57.6 0 31.5\n0 57.6 23.5\n0 0 2\n").find("no camera matrix"), std::string::npos);
  EXPECT_NE(refusal("57.6 0 31.5 0 57.6\n").find("wanted 9 (3x3) or 16 (4x4)"), std::string::npos);
}

TEST_F(Layouts, PosesFarFromAllOthersAreFound) {
  std::vector<Eigen::Isometry3d> poses;
  for (int n = 0; n < kFrames; ++n) poses.push_back(poseOf(n));
  EXPECT_TRUE(strayPoses(poses).empty());
  poses[4].translation().x() = 1e5;
  const auto stray = strayPoses(poses);
  ASSERT_EQ(stray.size(), 1U);
  EXPECT_EQ(stray[0].first, 4U);
  for (auto& T : poses) T.translation() += Eigen::Vector3d(356789.0, 5412345.0, 100.0);
  EXPECT_EQ(strayPoses(poses).size(), 1U);  // far from zero is no mistake
}

TEST_F(Layouts, UnknownFoldersSayWhatIsRead) {
  const auto refusal = [this] {
    return thrownMessage<std::runtime_error>([this] { FrameFolder(folder_.path(), FrameFolderOptions()); });
  };
  EXPECT_NE(refusal().find("ScanNet"), std::string::npos);
  write("seq-01/frame-000000.depth.pgm", "x");
  EXPECT_NE(refusal().find("seq-01"), std::string::npos);
}

}  // namespace
}  // namespace ttsdf
