#pragma once
// A folder with good files to spoil: depth frames, a mesh, a scan, and a map made of the mesh.

#include <cmath>
#include <filesystem>
#include <functional>
#include <iomanip>

#include "../support/rendered_scene.h"
#include "../tools/tool_process.h"

namespace ttsdf {

class Workshop {
 public:
  Workshop() {
    frames("frames", [](const Eigen::Isometry3d& T) { return T; });
    write("box.ply", box());
    write("identity.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    write("scan.xyz", "1 0 0\n0 1 0\n0 0 1\n");
    const ToolRun run = runProcess("ttsdf_build", {"--mesh", *this / "box.ply", "--voxel-size", "0.1",
                                                   "--truncation", "0.3", "--output", *this / "box.ttsdf"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }
  std::string operator/(const std::string& name) const { return folder_ / name; }
  std::string write(const std::string& name, const std::string& text) const {
    return folder_.write(name, text);
  }

  static std::string box(double scale = 1.0) {
    std::ostringstream out;
    out << "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 12\nproperty list uchar int vertex_indices\nend_header\n";
    for (int n = 0; n < 8; ++n) {
      out << scale * ((n & 4) != 0 ? 1.0 : -1.0) << ' ' << scale * ((n & 2) != 0 ? 0.75 : -0.75) << ' '
          << scale * ((n & 1) != 0 ? 0.5 : -0.5) << '\n';
    }
    return out.str() +
           "3 0 1 3\n3 0 3 2\n3 4 6 7\n3 4 7 5\n3 0 4 5\n3 0 5 1\n3 2 3 7\n3 2 7 6\n3 0 2 6\n3 0 6 4\n3 1 5 "
           "7\n3 1 7 3\n";
  }

  /// A folder of frames whose poses are recorded as `pose` makes them, in these units of depth.
  std::string frames(const std::string& folder,
                     const std::function<Eigen::Isometry3d(Eigen::Isometry3d)>& pose,
                     double units = 1000.0) const {
    std::filesystem::create_directories(*this / folder);
    for (int n = 0; n < kFrames; ++n) {
      std::ostringstream name, text;
      name << folder << "/frame-" << std::setw(6) << std::setfill('0') << n;
      text << std::setprecision(17) << pose(poseOf(n)).matrix() << '\n';
      write(name.str() + ".depth.pgm", depthImage(poseOf(n), units));
      write(name.str() + ".pose.txt", text.str());
    }
    write(folder + "/camera-intrinsics.txt", "57.6 0 31.5\n0 57.6 23.5\n0 0 1\n");
    return *this / folder;
  }

 private:
  static constexpr int kFrames = 12;

  static Eigen::Isometry3d poseOf(int n) {
    const double angle = 2.0 * M_PI * n / kFrames;
    return testing::lookAt({2.0 + 0.8 * std::cos(angle), 1.5 + 0.5 * std::sin(angle), 1.2},
                           {2.0 + 3.0 * std::cos(angle + 2.2), 1.5 + 3.0 * std::sin(angle + 2.2), 0.9});
  }
  static std::string depthImage(const Eigen::Isometry3d& pose, double units) {
    static const testing::Scene kRoom =
        testing::Scene().room({0, 0, 0}, {4, 3, 2.5}).box({1.0, 0.2, 0.0}, {1.6, 0.8, 0.9});
    const CameraIntrinsics k = testing::camera(64, 48);
    std::ostringstream pgm;
    pgm << "P5\n" << k.width << ' ' << k.height << "\n65535\n";
    for (const float z : testing::render(kRoom, k, pose).depth) {
      const auto raw = static_cast<unsigned>(std::lround(static_cast<double>(z) * units));
      pgm.put(static_cast<char>(raw >> 8 & 255u)).put(static_cast<char>(raw & 255u));
    }
    return pgm.str();
  }

  TempFolder folder_;
};

}  // namespace ttsdf
