#pragma once
// A box of known distances as a map, and what programs make of it.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "../tools/tool_process.h"
#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf {

constexpr double kVoxel = 0.05;
const Eigen::Array3d kHalf(1.0, 0.75, 0.5);

/// Exact signed distance to the box, positive outside.
inline double distance(const Eigen::Vector3d& p, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
  const Eigen::Array3d q = (p - centre).array().abs() - kHalf;
  return q.max(0.0).matrix().norm() + std::min(0.0, q.maxCoeff());
}

/// The box as a mesh, turned about z by `angle` and moved to `centre`.
inline std::string boxObj(const Eigen::Vector3d& centre, double angle) {
  const Eigen::AngleAxisd turn(angle, Eigen::Vector3d::UnitZ());
  std::ostringstream out;
  out.precision(12);
  for (int n = 0; n < 8; ++n) {
    const Eigen::Array3d side(n & 4 ? 1.0 : -1.0, n & 2 ? 1.0 : -1.0, n & 1 ? 1.0 : -1.0);
    const Eigen::Vector3d p = centre + turn * (kHalf * side).matrix();
    out << "v " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  }
  return out.str() +
         "f 1 2 4\nf 1 4 3\nf 5 7 8\nf 5 8 6\nf 1 5 6\nf 1 6 2\nf 3 4 8\nf 3 8 7\nf 1 3 7\nf 1 7 5\nf 2 6 "
         "8\nf 2 8 4\n";
}

/// Builds maps and exports them with the programs themselves.
class ExportTool : public ::testing::Test {
 protected:
  /// ttsdf_build of a source (--mesh FILE, ...); a path in the test's folder.
  std::string mapOf(const std::string& flag, const std::string& source, const std::string& name) {
    const std::string map = folder_ / (name + ".ttsdf");
    const ToolRun run = runProcess(
        "ttsdf_build", {flag, source, "--voxel-size", "0.05", "--truncation", "0.15", "--output", map});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return map;
  }
  std::string boxMap(const Eigen::Vector3d& centre = Eigen::Vector3d::Zero(), double angle = 0.0) {
    return mapOf("--mesh", folder_.write("box.obj", boxObj(centre, angle)), "box");
  }
  void exported(const std::vector<std::string>& arguments) {
    const ToolRun run = runProcess("ttsdf_export", arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }
  /// The mean and the largest distance of a mesh's vertices to the box.
  struct Distances {
    double mean = 0.0, largest = 0.0;
    Eigen::Index count = 0;
  };
  Distances distancesOf(const std::string& file, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
    const SurfaceMesh mesh = readMesh(file);
    Distances found;
    found.count = mesh.vertices.cols();
    for (Eigen::Index n = 0; n < found.count; ++n) {
      const double d = std::abs(distance(mesh.origin + mesh.vertices.col(n).cast<double>(), centre));
      found.mean += d / static_cast<double>(found.count);
      found.largest = std::max(found.largest, d);
    }
    return found;
  }

  TempFolder folder_;
};

}  // namespace ttsdf
