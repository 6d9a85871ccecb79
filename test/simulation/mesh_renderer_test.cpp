// Oracle: the exact ray casting of analytic solids.

#include "ttsdf_localization/simulation/mesh_renderer.h"

#include <gtest/gtest.h>

#include <cmath>

namespace ttsdf {
namespace {

DepthCameraOptions smallCamera() {
  DepthCameraOptions options;
  options.width = 160;
  options.height = 120;
  options.fx = options.fy = 130.0;
  return options;
}

SurfaceMesh boxMesh(const Eigen::Isometry3d& T, const Eigen::Vector3d& size) {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 8);
  for (int n = 0; n < 8; ++n) {
    const Eigen::Vector3d corner(n & 1 ? 0.5 : -0.5, n & 2 ? 0.5 : -0.5, n & 4 ? 0.5 : -0.5);
    mesh.vertices.col(n) = (T * corner.cwiseProduct(size)).cast<float>();
  }
  mesh.triangles.resize(3, 12);
  mesh.triangles << 0, 1, 4, 5, 0, 1, 2, 3, 0, 2, 1, 3,  //
      2, 2, 5, 7, 1, 5, 6, 6, 4, 4, 3, 7,                //
      1, 3, 6, 6, 4, 4, 3, 7, 2, 6, 5, 5;
  return mesh;
}

Eigen::Isometry3d tilted() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << 0.1, -0.05, 2.0;
  T.linear() = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, 2.0, 0.5).normalized()).toRotationMatrix();
  return T;
}

TEST(MeshRenderer, AgreesWithTheRayCastingOfABox) {
  const Eigen::Vector3d size(0.8, 0.6, 0.5);
  const DepthCamera camera(smallCamera());
  const DepthImage wanted =
      camera.render(AnalyticScene({Solid::box(tilted(), size)}), Eigen::Isometry3d::Identity());
  const DepthImage got = renderMesh(boxMesh(tilted(), size), smallCamera(), Eigen::Isometry3d::Identity());
  int both = 0, one = 0;
  for (std::size_t n = 0; n < wanted.depth.size(); ++n) {
    if ((wanted.depth[n] > 0.0f) != (got.depth[n] > 0.0f)) {
      ++one;
    } else if (wanted.depth[n] > 0.0f) {
      ++both;
      EXPECT_NEAR(got.depth[n], wanted.depth[n], 1e-5f);
    }
  }
  EXPECT_GT(both, 1000);
  EXPECT_LE(one, 2);  // rounding may take a pixel of the outline
}

TEST(MeshRenderer, ShowsTheNearestSurfaceFromEitherSide) {
  SurfaceMesh mesh;  // two squares across the optical axis, one turned away
  mesh.vertices.resize(3, 8);
  mesh.vertices << -1, 1, 1, -1, -1, 1, 1, -1,  //
      -1, -1, 1, 1, -1, -1, 1, 1,               //
      2, 2, 2, 2, 1.5, 1.5, 1.5, 1.5;
  mesh.triangles.resize(3, 4);
  mesh.triangles << 0, 0, 4, 4, 1, 2, 6, 7, 2, 3, 5, 6;
  const DepthImage image = renderMesh(mesh, smallCamera(), Eigen::Isometry3d::Identity());
  for (const float depth : {image.at(80, 60), image.at(40, 30)}) EXPECT_FLOAT_EQ(depth, 1.5f);
}

TEST(MeshRenderer, NoiseIsTheCamerasAndRepeats) {
  DepthCameraOptions options = smallCamera();
  options.noise = kinectNoise();
  const SurfaceMesh mesh = boxMesh(tilted(), {0.8, 0.6, 0.5});
  const Eigen::Isometry3d identity = Eigen::Isometry3d::Identity();
  const DepthImage exact = renderMesh(mesh, smallCamera(), identity);
  const DepthImage noisy = renderMesh(mesh, options, identity, 3);
  EXPECT_EQ(noisy.depth, renderMesh(mesh, options, identity, 3).depth);
  EXPECT_NE(noisy.depth, renderMesh(mesh, options, identity, 4).depth);
  double sum = 0.0;
  int count = 0;
  for (std::size_t n = 0; n < exact.depth.size(); ++n) {
    if (!(noisy.depth[n] > 0.0f)) continue;
    ASSERT_GT(exact.depth[n], 0.0f);
    sum += std::pow(static_cast<double>(noisy.depth[n] - exact.depth[n]), 2);
    ++count;
  }
  const double rms = std::sqrt(sum / count);
  EXPECT_GT(rms, 0.002);
  EXPECT_LT(rms, 0.03);
}

TEST(MeshRenderer, NothingBehindTheCamera) {
  Eigen::Isometry3d T_map_camera = Eigen::Isometry3d::Identity();
  T_map_camera.translation().z() = 5.0;
  const DepthImage image = renderMesh(boxMesh(tilted(), {0.8, 0.6, 0.5}), smallCamera(), T_map_camera);
  for (const float depth : image.depth) EXPECT_EQ(depth, 0.0f);
}

TEST(MeshRenderer, BadPoseAndBadIndexAreRefused) {
  SurfaceMesh mesh = boxMesh(tilted(), {0.8, 0.6, 0.5});
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().x() = std::nan("");
  EXPECT_THROW(renderMesh(mesh, smallCamera(), T), std::invalid_argument);
  mesh.triangles(0, 0) = 8;
  EXPECT_THROW(renderMesh(mesh, smallCamera(), Eigen::Isometry3d::Identity()), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
