// The point cloud methods on a shape whose pose is known, and what their maps cost.

#include <gtest/gtest.h>

#include <filesystem>

#include "ttsdf_localization/evaluation/map_memory.h"
#include "ttsdf_localization/evaluation/method_factory.h"
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

// The sensor looks down on the blocks and sees, here, every face that is turned to it. Sampled otherwise than
// the map: equal points would lock into each other.
ScanPoints scanFrom(const Eigen::Isometry3d& T_map_sensor) {
  const MapCloud map = blocks(0.037);
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

class LocalCloudMethod : public ::testing::TestWithParam<const char*> {};

TEST_P(LocalCloudMethod, ComesBackFromASmallPerturbation) {
  const MapCloud map = blocks();
  const Eigen::Isometry3d truth = sensorPose();
  CloudMethodOptions options;
  options.max_correspondence_distance = 0.2;
  const auto method = makeCloudMethod(GetParam(), map.points, options);
  const Eigen::Isometry3d prior = Eigen::Translation3d(0.04, -0.03, 0.05) * truth;
  const Estimate estimate = method->estimate(scanFrom(truth), prior, std::nullopt);
  const PoseError error = poseError(truth, estimate.T_map_sensor);
  EXPECT_LT(error.translation, 0.5 * poseError(truth, prior).translation);
  EXPECT_EQ(method->paperBytes(), 12u * static_cast<std::size_t>(map.points.cols()));
}

INSTANTIATE_TEST_SUITE_P(All, LocalCloudMethod, ::testing::Values("icp", "icp_plane", "gicp", "ndt"));

class FeatureMethod : public ::testing::TestWithParam<const char*> {};

TEST_P(FeatureMethod, FindsTheScanWithoutAPriorAndIgnoresOne) {
  const MapCloud map = blocks();
  const Eigen::Isometry3d truth = sensorPose();
  CloudMethodOptions options;
  options.ransac_inliers = 0.6;  // nearly all of this scan is in the map
  const auto method = makeFeatureMethod(GetParam(), map, options);
  const ScanPoints scan = scanFrom(truth);
  const Estimate estimate = method->estimate(scan, Eigen::Isometry3d::Identity(), std::nullopt);
  EXPECT_TRUE(estimate.accepted);
  EXPECT_LT(poseError(truth, estimate.T_map_sensor).translation,
            5.0 * options.feature_cell);  // FPFH's radius
  const Estimate other = method->estimate(scan, truth, std::nullopt);
  EXPECT_TRUE(estimate.T_map_sensor.isApprox(other.T_map_sensor));
}

TEST_P(FeatureMethod, TooFewPointsAreNoEstimate) {
  const auto method = makeFeatureMethod(GetParam(), blocks());
  const Estimate estimate =
      method->estimate(ScanPoints::Random(3, 5), Eigen::Isometry3d::Identity(), std::nullopt);
  EXPECT_FALSE(estimate.accepted);
  EXPECT_EQ(estimate.reason, "too_few_points");
}

TEST_P(FeatureMethod, CountsPointsAndDescriptors) {
  const MapCloud map = blocks();
  const auto method = makeFeatureMethod(GetParam(), map);
  EXPECT_EQ(method->paperBytes() % ((3 + 33) * sizeof(float)), 0u);
  EXPECT_GT(method->paperBytes(), 0u);
}

INSTANTIATE_TEST_SUITE_P(All, FeatureMethod, ::testing::Values("fpfh_ransac", "fpfh_fgr"));

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

TEST(MethodSpec, KnowsTheFeatureKinds) {
  EXPECT_EQ(parseMethodSpec("fpfh_ransac").kind, "fpfh_ransac");
  EXPECT_EQ(parseMethodSpec("fgr=fpfh_fgr:fgr_distance=0.02").label, "fgr");
  EXPECT_THROW(parseMethodSpec("teaser"), std::invalid_argument);
}

TEST(MapMemoryFile, ReplacesTheRowOfTheSameMethod) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("ttsdf_memory_" + std::to_string(::getpid()))).string();
  recordMapMemory(path, {"kitchen", "ours", 10, 20});
  recordMapMemory(path, {"kitchen", "icp", 1, 2});
  recordMapMemory(path, {"kitchen", "ours", 30, 40});
  const auto rows = readMapMemory(path);
  std::filesystem::remove(path);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].paper_bytes, 30u);
  EXPECT_EQ(rows[0].memory_bytes, 40u);
  EXPECT_EQ(rows[1].method, "icp");
}

}  // namespace
}  // namespace ttsdf
