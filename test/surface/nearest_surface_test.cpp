#include "ttsdf_localization/surface/nearest_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

namespace ttsdf {
namespace {

double bruteForce(const SurfaceMesh& mesh, const Eigen::Vector3f& p) {
  float best = std::numeric_limits<float>::max();
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
    const Eigen::Vector3i t = mesh.triangles.col(n);
    const TriangleFoot foot =
        closestPoint(p, mesh.vertices.col(t[0]), mesh.vertices.col(t[1]), mesh.vertices.col(t[2]));
    best = std::min(best, (p - foot.point).squaredNorm());
  }
  return std::sqrt(static_cast<double>(best));
}

/// A wavy sheet of small triangles.
SurfaceMesh waves(int size, float height) {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, size * size);
  mesh.triangles.resize(3, 2 * (size - 1) * (size - 1));
  Eigen::Index t = 0;
  for (int j = 0; j < size; ++j) {
    for (int i = 0; i < size; ++i) {
      const auto x = static_cast<float>(i), y = static_cast<float>(j);
      mesh.vertices.col(i + size * j) =
          Eigen::Vector3f(4.0F + x, 4.0F + y, 16.0F + height * std::sin(0.4F * x) * std::cos(0.3F * y));
      if (i + 1 == size || j + 1 == size) continue;
      const int a = i + size * j;
      mesh.triangles.col(t++) = Eigen::Vector3i(a, a + 1, a + size);
      mesh.triangles.col(t++) = Eigen::Vector3i(a + 1, a + 1 + size, a + size);
    }
  }
  return mesh;
}

TEST(ClosestPoint, IsNearestOfAllPointsOfTheTriangle) {
  std::mt19937 generator(1);
  const auto random = [&] { return static_cast<float>(generator()) / 4.0e9F * 2.0F - 1.0F; };
  for (int trial = 0; trial < 200; ++trial) {
    Eigen::Vector3f a(random(), random(), random()), b(random(), random(), random()),
        c(random(), random(), random());
    const Eigen::Vector3f p = 2.0F * Eigen::Vector3f(random(), random(), random());
    const TriangleFoot foot = closestPoint(p, a, b, c);
    EXPECT_NEAR(foot.weights.sum(), 1.0F, 1e-5F);
    EXPECT_GE(foot.weights.minCoeff(), 0.0F);
    EXPECT_LT((foot.weights[0] * a + foot.weights[1] * b + foot.weights[2] * c - foot.point).norm(), 1e-5F);
    float best = std::numeric_limits<float>::max();
    constexpr int kSteps = 60;
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; i + j <= kSteps; ++j) {
        const float u = static_cast<float>(i) / kSteps, v = static_cast<float>(j) / kSteps;
        best = std::min(best, (p - (u * a + v * b + (1.0F - u - v) * c)).norm());
      }
    }
    EXPECT_LE((p - foot.point).norm(), best + 1e-5F);
    EXPECT_GE((p - foot.point).norm(), best - 0.05F);  // the raster is that coarse
  }
}

TEST(ClosestPoint, SurvivesTrianglesWithoutArea) {
  const Eigen::Vector3f a(1, 2, 3), b(2, 2, 3), p(1.5F, 3.0F, 3.0F);
  for (const auto& foot :
       {closestPoint(p, a, a, a), closestPoint(p, a, a, b), closestPoint(p, a, b, a),
        closestPoint(p, b, a, a), closestPoint(p, a, b, Eigen::Vector3f(1.5F, 2.0F, 3.0F))}) {
    EXPECT_TRUE(foot.point.allFinite());
    EXPECT_TRUE(foot.weights.allFinite());
  }
}

TEST(NearestSurface, EqualsBruteForceOnACurvedSheet) {
  const SurfaceMesh mesh = waves(24, 3.0F);
  const Dims dims(32, 30, 34);
  const NearestSurface nearest = nearestSurface(mesh, dims, {});
  double near_sum = 0.0, all_sum = 0.0, largest = 0.0;
  int near_count = 0;
  std::size_t n = 0;
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i, ++n) {
        const double truth = bruteForce(
            mesh, Eigen::Vector3f(static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)));
        const double error = nearest.distance[n] - truth;
        ASSERT_GE(error, -1e-4);  // a distance to some point of the surface is never too small
        all_sum += error * error;
        largest = std::max(largest, error);
        if (truth < 10.0) near_sum += error * error, ++near_count;
        if (truth < 1.5) {
          ASSERT_NEAR(error, 0.0, 1e-3);
        }
      }
    }
  }
  // Far from waves this steep, two feet are about equally near and the second may win.
  EXPECT_LT(std::sqrt(near_sum / near_count), 0.01);
  EXPECT_LT(std::sqrt(all_sum / static_cast<double>(n)), 0.1);
  EXPECT_LT(largest, 1.0);
}

/// Two squares of small triangles that share an edge, with their vertices half-way between samples as those
/// of straight walls have them: feet lie on diagonals and edges.
SurfaceMesh corner(int size) {
  SurfaceMesh mesh;
  const int row = size + 1, sheet = row * row;
  mesh.vertices.resize(3, 2 * sheet);
  mesh.triangles.resize(3, 4 * size * size);
  Eigen::Index t = 0;
  for (int side = 0; side < 2; ++side) {
    for (int j = 0; j <= size; ++j) {
      for (int i = 0; i <= size; ++i) {
        const float u = 8.5F + static_cast<float>(i), v = static_cast<float>(j);
        const int n = i + row * j, a = n + side * sheet;
        mesh.vertices.col(a) =
            side == 0 ? Eigen::Vector3f(u, 8.5F + v, 10.3F) : Eigen::Vector3f(u, 8.5F, 10.3F + v);
        if (i == size || j == size) continue;
        // The second sheet's first row is the first one's.
        const auto vertex = [&](int m) { return side == 1 && m >= row ? m + sheet : m; };
        mesh.triangles.col(t++) = Eigen::Vector3i(vertex(n), vertex(n + 1), vertex(n + row));
        mesh.triangles.col(t++) = Eigen::Vector3i(vertex(n + 1), vertex(n + 1 + row), vertex(n + row));
      }
    }
  }
  return mesh;
}

TEST(NearestSurface, EqualsBruteForceAroundPlanesThatMeetAndEnd) {
  const SurfaceMesh mesh = corner(12);
  const Dims dims(30, 30, 30);
  NearestSurfaceOptions near_only;
  near_only.exact_within = near_only.none_beyond = 7.0F;
  const NearestSurface all = nearestSurface(mesh, dims, {}), near = nearestSurface(mesh, dims, near_only);
  std::size_t n = 0;
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i, ++n) {
        const double truth = bruteForce(
            mesh, Eigen::Vector3f(static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)));
        ASSERT_NEAR(all.distance[n], truth, 1e-4) << i << ' ' << j << ' ' << k;
        if (truth < 7.0) {
          ASSERT_NEAR(near.distance[n], truth, 1e-4) << i << ' ' << j << ' ' << k;
        }
      }
    }
  }
}

TEST(NearestSurface, FindsTheFootOnLargeTrianglesAfterSubdivision) {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 2.3F, 25.1F, 6.0F, 3.1F, 5.7F, 24.0F, 4.2F, 11.3F, 20.4F;
  mesh.triangles = Eigen::Vector3i(0, 1, 2);
  const Dims dims(28, 27, 26);
  const NearestSurface nearest = nearestSurface(subdivided(mesh, 1.5F), dims, {});
  std::size_t n = 0;
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i, ++n) {
        const double truth = bruteForce(
            mesh, Eigen::Vector3f(static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)));
        ASSERT_NEAR(nearest.distance[n], truth, 1e-4) << i << ' ' << j << ' ' << k;
      }
    }
  }
}

TEST(NearestSurface, DoesNotDependOnTheThreads) {
  const SurfaceMesh mesh = waves(20, 2.0F);
  NearestSurfaceOptions options;
  options.threads = 1;
  const NearestSurface one = nearestSurface(mesh, {28, 28, 32}, options);
  options.threads = 2;
  const NearestSurface two = nearestSurface(mesh, {28, 28, 32}, options);
  EXPECT_EQ(one.distance, two.distance);
  EXPECT_EQ(one.triangle, two.triangle);
}

TEST(NearestSurface, RefusesAMeshThatIsNotThere) {
  EXPECT_THROW(nearestSurface({}, {10, 10, 10}, {}), std::invalid_argument);
  SurfaceMesh far = waves(4, 0.0F);
  far.vertices.colwise() += Eigen::Vector3f(1000.0F, 0.0F, 0.0F);
  EXPECT_THROW(nearestSurface(far, {10, 10, 10}, {}), std::invalid_argument);
}

TEST(Subdivided, KeepsAreaAndSharedEdges) {
  const SurfaceMesh coarse = [] {
    SurfaceMesh mesh;
    mesh.vertices.resize(3, 4);
    mesh.vertices << 0, 9, 9, 0, 0, 0, 5, 5, 0, 0, 0, 0;
    mesh.triangles.resize(3, 2);
    mesh.triangles << 0, 0, 1, 2, 2, 3;
    return mesh;
  }();
  const SurfaceMesh fine = subdivided(coarse, 1.0F);
  double area = 0.0;
  for (Eigen::Index n = 0; n < fine.triangles.cols(); ++n) {
    const Eigen::Vector3i t = fine.triangles.col(n);
    for (int e = 0; e < 3; ++e)
      EXPECT_LE((fine.vertices.col(t[e]) - fine.vertices.col(t[(e + 1) % 3])).norm(), 1.0F);
    const Eigen::Vector3f a = fine.vertices.col(t[0]);
    area += 0.5 * (fine.vertices.col(t[1]) - a).cross(fine.vertices.col(t[2]) - a).z();
  }
  EXPECT_NEAR(area, 45.0, 1e-3);
  // Equal places are one vertex: the common diagonal stays common.
  for (Eigen::Index a = 0; a < fine.vertices.cols(); ++a) {
    for (Eigen::Index b = a + 1; b < fine.vertices.cols(); ++b)
      EXPECT_GT((fine.vertices.col(a) - fine.vertices.col(b)).norm(), 1e-4F);
  }
}

}  // namespace
}  // namespace ttsdf
