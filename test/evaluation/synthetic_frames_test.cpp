#include "ttsdf_localization/evaluation/synthetic_frames.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "ttsdf_localization/frames/frame_folder.h"
#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {
namespace {

const CameraIntrinsics kIntrinsics{64, 48, 50.0, 50.0, 31.5, 23.5};

TEST(FrameWriter, WritesWhatTheFolderReaderReads) {
  const auto folder = std::filesystem::temp_directory_path() / ("ttsdf_frames_" + std::to_string(::getpid()));
  DepthImage image{64, 48, std::vector<float>(64 * 48, 1.25f)};
  image.depth[5] = 0.0f;
  image.depth[6] = 100.0f;  // more than 16 bits of millimetres
  Vector6d twist;
  twist << 0.1, 0.2, -0.3, 1.0, 2.0, 3.0;
  FrameWriter(folder.string(), kIntrinsics).write(7, image, expSe3(twist));
  const FrameFolder frames(folder.string());
  ASSERT_EQ(frames.frames().size(), 1u);
  EXPECT_EQ(frames.frames()[0].index, 7);
  const DepthImage read = frames.depth(frames.frames()[0]);
  EXPECT_FLOAT_EQ(read.depth[0], 1.25f);
  EXPECT_FALSE(read.depth[5] > 0.0f);
  EXPECT_FALSE(read.depth[6] > 0.0f);
  EXPECT_TRUE(frames.pose(frames.frames()[0]).isApprox(expSe3(twist), 1e-9));
  EXPECT_NEAR(frames.intrinsics().cx, 31.5, 1e-12);
  std::filesystem::remove_all(folder);
}

TEST(ScaledMesh, IsCentredAndHasTheSize) {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 100.0f, 300.0f, 200.0f, 5.0f, 5.0f, 85.0f, 1.0f, 1.0f, 1.0f;
  mesh.triangles.resize(3, 1);
  mesh.triangles << 0, 1, 2;
  const SurfaceMesh scaled = scaledTo(mesh, 2.0);
  const Eigen::Vector3f low = scaled.vertices.rowwise().minCoeff(),
                        high = scaled.vertices.rowwise().maxCoeff();
  EXPECT_NEAR((high - low).maxCoeff(), 2.0f, 1e-6f);
  EXPECT_NEAR((high + low).norm(), 0.0f, 1e-6f);
  EXPECT_NEAR((high - low).y(), 0.8f, 1e-6f);
  mesh.vertices.setZero();
  EXPECT_THROW(scaledTo(mesh, 2.0), std::invalid_argument);
}

TEST(Views, FaceTheOriginAndHoldTheWholeBall) {
  const double radius = 0.7;
  const auto views = viewsAround(radius, 5, kIntrinsics);
  ASSERT_EQ(views.size(), 5u);
  for (const auto& T : views) {
    EXPECT_NEAR(T.linear().determinant(), 1.0, 1e-9);
    const Eigen::Vector3d origin = T.inverse() * Eigen::Vector3d::Zero();
    EXPECT_NEAR(origin.head<2>().norm(), 0.0, 1e-9);
    EXPECT_GT(origin.z(), radius);
    // Ball seen under the angle asin(radius / distance): it must fit the shorter side of the picture.
    const double edge = std::tan(std::asin(radius / origin.z())) * kIntrinsics.fy;
    EXPECT_LE(edge, 0.5 * kIntrinsics.height + 1e-9);
    for (const auto& other : views) {
      if (&other != &T) EXPECT_GT((other.translation() - T.translation()).norm(), radius);
    }
  }
  EXPECT_THROW(viewsAround(0.0, 5, kIntrinsics), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
