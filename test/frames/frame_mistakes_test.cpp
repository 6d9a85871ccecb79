// The mistakes that people make with frame folders, and what is said of them.

#include "layouts.h"

namespace ttsdf {
namespace {

using testing::thrownMessage;

Eigen::Isometry3d asIs(const Eigen::Isometry3d& T) { return T; }

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

TEST_F(Layouts, LeftHandedPosesAreNamedAndTurnedRound) {
  for (const int axis : {0, 1, 2}) {
    Eigen::Vector3d mirror = Eigen::Vector3d::Ones();
    mirror[axis] = -1.0;
    const auto mirrored = [&mirror](Eigen::Isometry3d T) {
      T.linear() = mirror.asDiagonal() * T.linear() * mirror.asDiagonal();
      T.translation() = mirror.cwiseProduct(T.translation());
      return T;
    };
    writeScenes(mirrored);
    expectAdvice(std::string("--mirror-poses ") + "xyz"[axis]);
    FrameFolderOptions options;
    options.mirrored_axis = "xyz"[axis];
    EXPECT_EQ(check(options).verdict(), FrameCheck::Verdict::kGood);
    const FrameFolder folder(folder_.path(), options);
    EXPECT_LT((folder.pose(folder.frames()[3]).matrix() - poseOf(3).matrix()).cwiseAbs().maxCoeff(), 1e-9);
    writeScenes([&mirrored](const Eigen::Isometry3d& T) { return mirrored(T.inverse()); });
    expectAdvice(std::string("--poses world-to-camera --mirror-poses ") + "xyz"[axis]);
  }
}

/// A level camera on a round: what is mirrored in half of the pose shows in few views.
class LevelCamera : public Layouts {
 protected:
  static constexpr int kRound = 48;
  template <class Pose>
  void writeRound(const Pose& pose) {
    for (int n = 0; n < kRound; ++n) {
      const Eigen::Isometry3d T = level(n);
      const std::string name = "frame-" + number(n, 6);
      writePgm(file(name + ".depth.pgm"), testing::render(room(), camera_, T), 1000.0);
      write(name + ".pose.txt", matrixText(pose(T).matrix()));
    }
    write("camera-intrinsics.txt", cameraText(3));
  }
  double radius_ = 1.2;  // [m]
  Eigen::Isometry3d level(int n) const {
    const double angle = 2.0 * 3.14159265358979 * n / kRound;
    const Eigen::Vector3d eye(2.0 + radius_ * std::cos(angle), 1.5 + 0.75 * radius_ * std::sin(angle), 1.2);
    return testing::lookAt(eye, eye + Eigen::Vector3d(std::cos(angle + 0.7), std::sin(angle + 0.7), 0.0));
  }
  /// The advice, taken, gives poses that agree.
  void expectMirror(const std::string& option, const FrameFolderOptions& options) {
    expectAdvice("--mirror-poses " + option);
    EXPECT_EQ(check(options).verdict(), FrameCheck::Verdict::kGood) << option;
    const FrameFolder folder(folder_.path(), options);
    EXPECT_LT((folder.pose(folder.frames()[3]).matrix() - level(3).matrix()).cwiseAbs().maxCoeff(), 1e-9);
  }
};

TEST_F(LevelCamera, MirroredPositionsAreNamed) {
  for (const int axis : {0, 1}) {
    writeRound([axis](Eigen::Isometry3d T) {
      T.translation()[axis] *= -1.0;
      return T;
    });
    FrameFolderOptions options;
    options.mirrored_positions = "xyz"[axis];
    expectMirror(std::string("positions-") + "xyz"[axis], options);
    writeRound([axis](Eigen::Isometry3d T) {
      T.translation()[axis] *= -1.0;
      return T.inverse();
    });
    expectAdvice(std::string("--poses world-to-camera --mirror-poses positions-") + "xyz"[axis]);
  }
  writeRound(asIs);
  EXPECT_EQ(check().verdict(), FrameCheck::Verdict::kGood) << check().message();
}

Eigen::Isometry3d withMirroredRotation(Eigen::Isometry3d T, const std::string& axes) {
  Eigen::Vector3d world = Eigen::Vector3d::Ones(), camera = Eigen::Vector3d::Ones();
  world[axes[0] - 'x'] = -1.0, camera[axes[1] - 'x'] = -1.0;
  T.linear() = world.asDiagonal() * T.linear() * camera.asDiagonal();
  return T;
}

TEST_F(Layouts, MirroredRotationsAreNamed) {
  for (const std::string axes : {"xx", "yy", "zz", "yx", "xz"}) {
    writeScenes([&axes](const Eigen::Isometry3d& T) { return withMirroredRotation(T, axes); });
    expectAdvice("--mirror-poses rotations-" + axes);
    FrameFolderOptions options;
    options.mirrored_rotations = axes;
    EXPECT_EQ(check(options).verdict(), FrameCheck::Verdict::kGood) << axes;
    const FrameFolder folder(folder_.path(), options);
    EXPECT_LT((folder.pose(folder.frames()[3]).matrix() - poseOf(3).matrix()).cwiseAbs().maxCoeff(), 1e-9);
  }
}

/// Of a level camera several readings are the same but for a turn of the whole map.
TEST_F(LevelCamera, MirroredRotationsAreExplained) {
  for (const std::string axes : {"yy", "xx", "zz", "yx"}) {
    writeRound([&axes](const Eigen::Isometry3d& T) { return withMirroredRotation(T, axes); });
    const FrameCheck found = check();
    EXPECT_EQ(found.verdict(), FrameCheck::Verdict::kNonsense) << axes << found.message();
    EXPECT_GT(found.best.share, 0.95) << axes << found.message();
  }
}

/// A camera that turns about and moves little: as given most points agree, and the mistake is named still.
TEST_F(LevelCamera, MirroredPositionsOfSmallRoundsAreNamed) {
  for (const double radius : {0.15, 0.2, 0.4}) {
    radius_ = radius;
    for (const int axis : {0, 1}) {
      writeRound([axis](Eigen::Isometry3d T) {
        T.translation()[axis] *= -1.0;
        return T;
      });
      expectAdvice(std::string("--mirror-poses positions-") + "xyz"[axis]);
    }
    writeRound(asIs);
    EXPECT_EQ(check().verdict(), FrameCheck::Verdict::kGood) << check().message();
  }
}

TEST_F(Layouts, DepthScalesOfOtherCamerasAreNamed) {
  for (const double units : {256.0, 4000.0, 5000.0, 6553.5, 8000.0}) {
    writeScenes(asIs, units);
    std::ostringstream option;
    option << "--depth-scale " << units;
    expectAdvice(option.str());
  }
}

TEST_F(Layouts, APrincipalPointOfAPortraitImageIsNamed) {
  writeScenes(asIs);
  std::ostringstream text;
  text << camera_.fx << " 0 " << camera_.cy << "\n0 " << camera_.fy << ' ' << camera_.cx << "\n0 0 1\n";
  write("camera-intrinsics.txt", text.str());
  expectAdvice("principal point in the images' middle");
}

/// Faster and slower: a camera that turns evenly looks the same at any shift.
double unevenly(double n) { return n + 1.5 * std::sin(0.9 * n); }

class StampedFrames : public Layouts {
 protected:
  static constexpr int kImages = 40;
  template <class Text>
  void writeTum(double first_pose_stamp, const Text& poseText) {
    std::string list, truth;
    for (int n = 0; n < kImages; ++n) {
      const double place = unevenly(0.25 * n);
      const std::string name = "depth/" + std::to_string(n) + ".pgm";
      writePgm(file(name), testing::render(room(), camera_, poseOf(place)), 5000.0);
      list += std::to_string(100.0 + 0.1 * n) + " " + name + "\n";
      truth += std::to_string(first_pose_stamp + 0.1 * n) + " " + poseText(poseOf(place)) + "\n";
    }
    write("depth.txt", list);
    write("groundtruth.txt", truth);
    write("camera-intrinsics.txt", cameraText(3));
  }
};

TEST_F(StampedFrames, ClocksThatDifferAreNamedWithTheShift) {
  for (const double shift : {0.4, -0.7}) {
    writeTum(100.0 + shift, quaternionText);
    std::ostringstream option;
    option << "--stamp-shift " << shift;
    const FrameCheck found = check();
    EXPECT_EQ(found.verdict(), FrameCheck::Verdict::kNonsense) << found.message();
    EXPECT_NE(found.message().find(option.str()), std::string::npos) << found.message();
    FrameFolderOptions options;
    options.stamp_shift = shift;
    EXPECT_EQ(check(options).verdict(), FrameCheck::Verdict::kGood);
  }
}

TEST_F(StampedFrames, ClocksWithoutACommonTimeAreNamed) {
  writeTum(5000.0, quaternionText);
  const std::string message =
      thrownMessage<std::runtime_error>([this] { FrameFolder(folder_.path(), FrameFolderOptions()); });
  EXPECT_NE(message.find("stamps from 100.000 to 103.900 s and poses from 5000.000"), std::string::npos)
      << message;
}

TEST_F(StampedFrames, QuaternionsInTheOtherOrderAreNamed) {
  writeTum(100.0, [](const Eigen::Isometry3d& T) {
    const Eigen::Quaterniond q(T.linear());
    std::ostringstream out;
    out << std::setprecision(17) << T.translation().transpose() << ' ' << q.w() << ' ' << q.x() << ' '
        << q.y() << ' ' << q.z();
    return out.str();
  });
  expectAdvice("--quaternions wxyz");
  FrameFolderOptions options;
  options.quaternions_w_first = true;
  EXPECT_EQ(check(options).verdict(), FrameCheck::Verdict::kGood);
}

/// Images that are missing must not shift the poses of those behind them.
TEST_F(Layouts, MissingImagesLeaveTheOthersTheirPoses) {
  std::string log, lines;
  for (int n = 0; n < kFrames; ++n) {
    log += std::to_string(n) + " " + std::to_string(n) + " " + std::to_string(n + 1) + "\n" +
           matrixText(poseOf(n).matrix());
    lines += quaternionText(poseOf(n)) + "\n";
  }
  write("camera-intrinsics.txt", cameraText(3));
  for (const int first : {0, 1}) {
    std::filesystem::remove_all(folder_.file("depth"));
    for (int n = 0; n < kFrames; ++n) {
      if (n < 3 || n > 5)
        writePgm(file("depth/" + number(n + first, 5) + ".pgm"), images_[static_cast<std::size_t>(n)],
                 1000.0);
    }
    write("trajectory.log", log);
    expectFrames("Redwood / Open3D", 1000.0, kFrames - 3);
    std::filesystem::remove(folder_.file("trajectory.log"));
    write("poses.txt", lines);
    expectFrames("depth images with a list of poses", 1000.0, kFrames - 3);
  }
  // The first ones of a count from 0, or the last ones of a count from 1?
  for (const int first : {1, 3}) {
    std::filesystem::remove_all(folder_.file("depth"));
    for (int n = first; n < kFrames; ++n)
      writePgm(file("depth/" + number(n, 5) + ".pgm"), images_[0], 1000.0);
    const std::string message =
        thrownMessage<std::runtime_error>([this] { FrameFolder(folder_.path(), FrameFolderOptions()); });
    EXPECT_NE(message.find("images with numbers from " + std::to_string(first) + " to 11 for 12 poses"),
              std::string::npos)
        << message;
  }
}

TEST_F(Layouts, PosesInOtherWritings) {
  writeScenes(asIs);
  const FrameFolder folder(folder_.path(), FrameFolderOptions());
  const std::string path = folder.frames()[3].pose_path, text = matrixText(poseOf(3).matrix());
  const auto expectPose = [&](const std::string& content) {
    std::ofstream(path, std::ios::binary) << content;
    EXPECT_LT((readPose(path).matrix() - poseOf(3).matrix()).cwiseAbs().maxCoeff(), 1e-9) << content;
  };
  expectPose("\xef\xbb\xbf" + text);
  expectPose(text.substr(0, text.rfind("0 0 0 1")));
  std::string list = "[[";
  for (const char c : text)
    list += c == ' ' ? std::string(", ") : c == '\n' ? std::string("],\r\n[") : std::string(1, c);
  expectPose(list + "]]");
  std::ofstream(path, std::ios::binary) << matrixText(poseOf(3).matrix().transpose());
  EXPECT_NE(thrownMessage<std::runtime_error>([&] { readPose(path); }).find("column by column"),
            std::string::npos);
}

}  // namespace
}  // namespace ttsdf
