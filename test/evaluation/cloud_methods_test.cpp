// The point cloud methods on a shape whose pose is known, and what their maps cost.

#include <gtest/gtest.h>
#include <pcl/pcl_config.h>

#include <cmath>
#include <filesystem>

#include "ttsdf_localization/evaluation/method_factory.h"
#include "ttsdf_localization/evaluation/method_memory.h"
#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {
namespace {

void addBox(SurfaceMesh& mesh, const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  const int first = static_cast<int>(mesh.vertices.cols());
  const Eigen::Index triangles = mesh.triangles.cols();
  mesh.vertices.conservativeResize(3, first + 8);
  for (int n = 0; n < 8; ++n) {
    mesh.vertices.col(first + n) << (n & 1 ? high : low).x(), (n & 2 ? high : low).y(),
        (n & 4 ? high : low).z();
  }
  mesh.triangles.conservativeResize(3, triangles + 12);
  const int faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                            {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (int n = 0; n < 12; ++n) {
    for (int k = 0; k < 3; ++k) mesh.triangles(k, triangles + n) = first + faces[n][k];
  }
}

// Blocks of all sizes on a plate: no symmetry, corners everywhere.
MapCloud blocks(double cell = 0.05) {
  SurfaceMesh mesh;
  addBox(mesh, {-2.0f, -1.5f, -0.5f}, {2.0f, 1.5f, 0.0f});
  addBox(mesh, {-1.8f, -1.2f, 0.0f}, {-1.0f, -0.4f, 0.7f});
  addBox(mesh, {0.2f, 0.3f, 0.0f}, {1.7f, 0.8f, 0.4f});
  addBox(mesh, {-0.6f, 0.6f, 0.0f}, {-0.3f, 1.3f, 1.2f});
  addBox(mesh, {0.9f, -1.3f, 0.0f}, {1.2f, -0.9f, 0.9f});
  addBox(mesh, {-1.6f, 0.5f, 0.0f}, {-1.2f, 0.9f, 0.3f});
  return mapCloudFromMesh(mesh, cell);
}

// Hills of all widths: descriptors need curvature, on flat faces they all look alike.
MapCloud hills(double cell = 0.05) {
  constexpr int kAlong = 81, kAcross = 61;
  SurfaceMesh mesh;
  mesh.vertices.resize(3, kAlong * kAcross);
  mesh.triangles.resize(3, 2 * (kAlong - 1) * (kAcross - 1));
  for (int i = 0, n = 0; i < kAlong; ++i) {
    for (int j = 0; j < kAcross; ++j) {
      const double x = 0.05 * i - 2.0, y = 0.05 * j - 1.5;
      const double z = 0.25 * std::sin(2.1 * x + 0.7 * y * y) + 0.2 * std::cos(3.3 * y - 0.9 * x * x) +
                       0.1 * std::sin(5.7 * x + 4.1 * y) * std::exp(0.3 * x);
      const int v = i * kAcross + j;
      mesh.vertices.col(v) = Eigen::Vector3d(x, y, z).cast<float>();
      if (i + 1 == kAlong || j + 1 == kAcross) continue;
      mesh.triangles.col(n++) << v, v + kAcross, v + 1;
      mesh.triangles.col(n++) << v + 1, v + kAcross, v + kAcross + 1;
    }
  }
  return mapCloudFromMesh(mesh, cell);
}

// The sensor looks down on the shape and sees, here, every face that is turned to it. Sampled otherwise than
// the map: equal points would lock into each other.
ScanPoints scanFrom(const Eigen::Isometry3d& T_map_sensor, const MapCloud& map = blocks(0.037)) {
  ScanPoints points(3, 0);
  for (Eigen::Index n = 0; n < map.points.cols(); ++n) {
    const Eigen::Vector3f to_sensor = T_map_sensor.translation().cast<float>() - map.points.col(n);
    if (map.towards_sensor.col(n).dot(to_sensor) <= 0.0f) continue;
    points.conservativeResize(3, points.cols() + 1);
    points.rightCols<1>() = T_map_sensor.inverse().cast<float>() * map.points.col(n);
  }
  return points;
}

Eigen::Isometry3d sensorPose() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << 0.2, -0.3, 3.0;
  T.linear() =
      (Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(3.0, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  return T;
}

class LocalCloudMethod : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (isOpen3d() && !hasOpen3d()) GTEST_SKIP() << "this build has no Open3D";
  }
  static bool isOpen3d() { return std::string(GetParam()).rfind("open3d", 0) == 0; }
  static std::unique_ptr<Method> make(const MapCloud& map, const CloudMethodOptions& options) {
    return isOpen3d() ? makeOpen3dMethod(GetParam(), map, options)
                      : makeCloudMethod(GetParam(), map.points, options);
  }
};

TEST_P(LocalCloudMethod, ComesBackFromASmallPerturbation) {
#if PCL_VERSION_COMPARE(<, 1, 12, 0)
  if (std::string(GetParam()) == "ndt") GTEST_SKIP() << "NDT of PCL before 1.12 does not come back";
#endif
  const MapCloud map = blocks();
  const Eigen::Isometry3d truth = sensorPose();
  CloudMethodOptions options;
  options.max_correspondence_distance = 0.2;
  const auto method = make(map, options);
  const Eigen::Isometry3d prior = Eigen::Translation3d(0.04, -0.03, 0.05) * truth;
  const Estimate estimate = method->estimate(scanFrom(truth), prior, std::nullopt);
  const PoseError error = poseError(truth, estimate.T_map_sensor);
  EXPECT_LT(error.translation, 0.5 * poseError(truth, prior).translation);
  EXPECT_EQ(method->paperBytes(), 12u * static_cast<std::size_t>(map.points.cols()));
}

INSTANTIATE_TEST_SUITE_P(Pcl, LocalCloudMethod, ::testing::Values("icp", "icp_plane", "gicp", "ndt"));
INSTANTIATE_TEST_SUITE_P(Open3d, LocalCloudMethod, ::testing::Values("open3d_icp", "open3d_icp_plane"));

class FeatureMethod : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!hasOpen3d()) GTEST_SKIP() << "this build has no Open3D";
  }
};

TEST_P(FeatureMethod, FindsTheScanWithoutAPrior) {
  const MapCloud map = hills();
  const Eigen::Isometry3d truth = sensorPose();
  CloudMethodOptions options;
  const auto method = makeOpen3dMethod(GetParam(), map, options);
  const ScanPoints scan = scanFrom(truth, hills(0.037));
  const Estimate estimate = method->estimate(scan, Eigen::Isometry3d::Identity(), std::nullopt);
  EXPECT_TRUE(estimate.accepted);
  EXPECT_LT(poseError(truth, estimate.T_map_sensor).translation,
            5.0 * options.feature_cell);  // FPFH's radius
}

TEST_P(FeatureMethod, TooFewPointsAreNoEstimate) {
  const auto method = makeOpen3dMethod(GetParam(), blocks());
  const Estimate estimate =
      method->estimate(ScanPoints::Random(3, 5), Eigen::Isometry3d::Identity(), std::nullopt);
  EXPECT_FALSE(estimate.accepted);
  EXPECT_EQ(estimate.reason, "too_few_points");
}

TEST_P(FeatureMethod, CountsPointsAndDescriptors) {
  const MapCloud map = blocks();
  const auto method = makeOpen3dMethod(GetParam(), map);
  EXPECT_EQ(method->paperBytes() % ((3 + 33) * sizeof(float)), 0u);
  EXPECT_GT(method->paperBytes(), 0u);
}

INSTANTIATE_TEST_SUITE_P(All, FeatureMethod, ::testing::Values("fgr", "ransac"));

TEST(MapCloud, OfAMeshCoversItsSurfaceEvenly) {
  SurfaceMesh mesh;
  addBox(mesh, {0.0f, 0.0f, 0.0f}, {1.0f, 1.0f, 1.0f});
  const MapCloud cloud = mapCloudFromMesh(mesh, 0.1);
  EXPECT_GT(cloud.points.cols(), 500);  // 600 cells' worth of area
  for (Eigen::Index n = 0; n < cloud.points.cols(); ++n) {
    const Eigen::Vector3f p = cloud.points.col(n), outward = cloud.towards_sensor.col(n);
    EXPECT_GT((p.array() - 0.5f).abs().maxCoeff(), 0.4f);
    EXPECT_GT(outward.dot(p - Eigen::Vector3f::Constant(0.5f)), 0.0f);
  }
}

TEST(MethodSpec, KnowsTheKinds) {
  EXPECT_EQ(parseMethodSpec("open3d_icp").kind, "open3d_icp");
  EXPECT_EQ(parseMethodSpec("TT-SDF=paper:max_iterations=50").label, "TT-SDF");
  EXPECT_THROW(parseMethodSpec("teaser"), std::invalid_argument);
}

TEST(MapMemoryFile, ReplacesTheRowOfTheSameMethod) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("ttsdf_memory_" + std::to_string(::getpid()))).string();
  recordMethodMemory(path, {"kitchen", "ours", 10, 20});
  recordMethodMemory(path, {"kitchen", "icp", 1, 2});
  recordMethodMemory(path, {"kitchen", "ours", 30, 40});
  const auto rows = readMethodMemory(path);
  std::filesystem::remove(path);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].paper_bytes, 30u);
  EXPECT_EQ(rows[0].memory_bytes, 40u);
  EXPECT_EQ(rows[1].method, "icp");
}

}  // namespace
}  // namespace ttsdf
