// Every layout of frame folders, written here around the same views of a room.

#include "layouts.h"

namespace ttsdf {
namespace {

using testing::thrownMessage;

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

TEST_F(Layouts, IntrinsicsOfAnImpossibleSizeAreRefused) {
  writeScenes([](const Eigen::Isometry3d& T) { return T; });
  std::filesystem::remove(folder_.file("camera-intrinsics.txt"));
  for (const char* size : {"1e32", "-1", "70000"}) {
    write("intrinsic.json", std::string("{\"width\": 64, \"height\": ") + size +
                                ", \"intrinsic_matrix\": [60, 0, 0, 0, 60, 0, 32, 24, 1]}");
    const std::string text =
        thrownMessage<std::runtime_error>([this] { FrameFolder(folder_.path(), FrameFolderOptions()); });
    EXPECT_NE(text.find("image size of 64 x " + std::string(size).substr(0, 2)), std::string::npos) << text;
  }
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
