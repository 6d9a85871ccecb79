#include "ros/operator/map_visualization.h"

#include <gtest/gtest.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <cmath>
#include <cstdint>

#include "ttsdf_localization/field/dense_distance_field.h"

namespace ttsdf {
namespace {

/// A square of n x n cells of two triangles in the plane z = 0, side 1 m.
SurfaceMesh square(int n) {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, (n + 1) * (n + 1));
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      mesh.vertices.col(i + (n + 1) * j) << static_cast<float>(i) / static_cast<float>(n),
          static_cast<float>(j) / static_cast<float>(n), 0.0F;
    }
  }
  mesh.triangles.resize(3, 2 * n * n);
  for (int j = 0, t = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const int a = i + (n + 1) * j, b = a + 1, c = a + n + 1, d = c + 1;
      mesh.triangles.col(t++) << a, b, d;
      mesh.triangles.col(t++) << a, d, c;
    }
  }
  return mesh;
}

double areaOf(const visualization_msgs::Marker& marker) {
  double area = 0.0;
  for (std::size_t t = 0; t + 2 < marker.points.size(); t += 3) {
    const auto corner = [&](std::size_t n) {
      return Eigen::Vector3d(marker.points[t + n].x, marker.points[t + n].y, marker.points[t + n].z);
    };
    area += 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm();
  }
  return area;
}

TEST(SurfaceMarker, HoldsEveryTriangle) {
  const auto marker = surfaceMarker(square(10), 1000, "hall", ros::Time(3.0));
  EXPECT_EQ(marker.header.frame_id, "hall");
  EXPECT_EQ(marker.action, visualization_msgs::Marker::ADD);
  EXPECT_EQ(marker.points.size(), 3U * 200U);
  EXPECT_EQ(marker.colors.size(), marker.points.size());
  EXPECT_NEAR(areaOf(marker), 1.0, 1e-6);
}

TEST(SurfaceMarker, ThinsALargeMeshButKeepsItsShape) {
  const auto marker = surfaceMarker(square(100), 2000, "map", ros::Time(3.0));
  EXPECT_LE(marker.points.size(), 3U * 2000U);
  EXPECT_GE(marker.points.size(), 3U * 500U);
  // Joined vertices move inwards at the rim by half a cell at most; cells are below 1/20 m for 2000
  // triangles.
  EXPECT_NEAR(areaOf(marker), 1.0, 0.1);
}

TEST(SurfaceMarker, RemovesTheOldSurfaceWhenEmpty) {
  EXPECT_EQ(surfaceMarker({}, 1000, "map", ros::Time(3.0)).action, visualization_msgs::Marker::DELETE);
}

TEST(ClusterVertices, KeepsAMeshThatIsCoarserThanTheCell) {
  const SurfaceMesh mesh = square(4);
  const SurfaceMesh same = clusterVertices(mesh, 0.01);
  EXPECT_EQ(same.vertices.cols(), mesh.vertices.cols());
  EXPECT_EQ(same.triangles.cols(), mesh.triangles.cols());
}

TEST(SliceCloud, ColoursSidesOfASurfaceAndTheUnknown) {
  // Distance to the plane x = 0.5 m; nothing is known where y > 0.5 m.
  DenseTensor tensor(Dims(11, 11, 11));
  for (int k = 0; k < 11; ++k) {
    for (int j = 0; j < 11; ++j) {
      for (int i = 0; i < 11; ++i) tensor(i, j, k) = 0.1F * static_cast<float>(i) - 0.5F;
    }
  }
  GridGeometry geometry;
  geometry.dims = tensor.dims();
  geometry.voxel_size = 0.1;
  SupportMask mask(geometry.dims, 1, true);
  for (int k = 0; k < 11; ++k) {
    for (int j = 6; j < 11; ++j) {
      for (int i = 0; i < 11; ++i) mask.set(i, j, k, false);
    }
  }
  const DenseDistanceField field(tensor, geometry, mask);
  auto cloud = sliceCloud(field, 0.45, 0.1, 0.2, "map", ros::Time(3.0));
  int red = 0, blue = 0, grey = 0, points = 0;
  sensor_msgs::PointCloud2Iterator<float> xyz(cloud, "x");
  sensor_msgs::PointCloud2Iterator<std::uint8_t> bgr(cloud, "rgb");
  for (; xyz != xyz.end(); ++xyz, ++bgr, ++points) {
    EXPECT_FLOAT_EQ(xyz[2], 0.45F);
    const int b = bgr[0], g = bgr[1], r = bgr[2];
    if (r == b && r == g) {
      if (r < 100) {
        ++grey;
        EXPECT_GT(xyz[1], 0.5F);
      }
    } else if (r > b) {
      ++red;
      EXPECT_GT(xyz[0], 0.5F);
    } else {
      ++blue;
      EXPECT_LT(xyz[0], 0.5F);
    }
  }
  EXPECT_GE(points, 100);
  EXPECT_GT(red, 20);
  EXPECT_GT(blue, 20);
  EXPECT_GT(grey, 20);
}

}  // namespace
}  // namespace ttsdf
