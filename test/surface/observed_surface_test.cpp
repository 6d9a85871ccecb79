#include "ttsdf_localization/surface/observed_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "../support/analytic_observation.h"
#include "ttsdf_localization/mapping/map_builder.h"

namespace ttsdf {
namespace {

constexpr double kVoxel = 0.02, kTruncation = 0.06;

double sphere(const Eigen::Vector3d& p) { return (p - Eigen::Vector3d(0.013, -0.004, 0.007)).norm() - 0.4; }

double largestDistance(const SurfaceMesh& mesh, const testing::Distance& truth) {
  double largest = 0.0;
  for (Eigen::Index n = 0; n < mesh.vertices.cols(); ++n) {
    largest = std::max(largest, std::abs(truth(mesh.vertices.col(n).cast<double>())));
  }
  return largest;
}

int borderVertices(const ObservedSurface& surface) {
  return static_cast<int>(std::count(surface.border_vertex.begin(), surface.border_vertex.end(), 1));
}

TEST(ObservedSurface, IsTheSphereAndNotTheBackOfItsShell) {
  const ObservedSurface surface =
      observedSurface(testing::observe(sphere, {50, 50, 50}, {-25, -25, -25}, kVoxel, kTruncation), 1);
  ASSERT_GT(surface.mesh.triangles.cols(), 5000);
  EXPECT_LT(largestDistance(surface.mesh, sphere), 0.02 * kVoxel);
  EXPECT_EQ(borderVertices(surface), 0);
  for (Eigen::Index n = 0; n < surface.mesh.vertices.cols(); ++n) {
    const Eigen::Vector3d outwards =
        (surface.mesh.vertices.col(n).cast<double>() - Eigen::Vector3d(0.013, -0.004, 0.007)).normalized();
    EXPECT_GT(surface.normals.col(n).cast<double>().dot(outwards), 0.99);
  }
}

TEST(ObservedSurface, FacesTurnTowardsFreeSpace) {
  const ObservedSurface surface =
      observedSurface(testing::observe(sphere, {50, 50, 50}, {-25, -25, -25}, kVoxel, kTruncation), 1);
  double volume = 0.0;
  for (Eigen::Index n = 0; n < surface.mesh.triangles.cols(); ++n) {
    Eigen::Matrix3d corners;
    for (int c = 0; c < 3; ++c)
      corners.col(c) = surface.mesh.vertices.col(surface.mesh.triangles(c, n)).cast<double>();
    volume += corners.determinant() / 6.0;
  }
  EXPECT_NEAR(volume, 4.0 / 3.0 * M_PI * std::pow(0.4, 3), 0.002);
}

TEST(ObservedSurface, DoesNotCareForTheSlopeOfAProjectiveDistance) {
  // Rays that graze a plane make its distance 2.5 times as long.
  const auto plane = [](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(0.3, 0.2, 1.0).normalized().dot(p) - 0.0031;
  };
  const ObservedSurface surface =
      observedSurface(testing::observe([&](const Eigen::Vector3d& p) { return 2.5 * plane(p); }, {30, 30, 40},
                                       {-15, -15, -20}, kVoxel, kTruncation),
                      1);
  ASSERT_GT(surface.mesh.triangles.cols(), 500);
  EXPECT_LT(largestDistance(surface.mesh, plane), 1e-3 * kVoxel);
}

TEST(ObservedSurface, KeepsSharpEdges) {
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()))
          .toRotationMatrix();
  const auto box = [&](const Eigen::Vector3d& p) {
    return testing::boxDistance(turn * p, {0.31, 0.27, 0.25});
  };
  const ObservedSurface surface =
      observedSurface(testing::observe(box, {50, 50, 50}, {-25, -25, -25}, kVoxel, kTruncation), 1);
  // Without care the mean of the crossings cuts an edge by up to 0.7 voxel. Nearly all edge vertices must be
  // right.
  double sum = 0.0;
  for (Eigen::Index n = 0; n < surface.mesh.vertices.cols(); ++n)
    sum += std::pow(box(surface.mesh.vertices.col(n).cast<double>()), 2);
  EXPECT_LT(std::sqrt(sum / static_cast<double>(surface.mesh.vertices.cols())), 0.02 * kVoxel);
}

TEST(ObservedSurface, EndsWhereObservationEnds) {
  const auto seen = [](const Eigen::Vector3d& p) { return p.head<2>().cwiseAbs().maxCoeff() < 0.21; };
  const ObservedSurface surface =
      observedSurface(testing::observe([](const Eigen::Vector3d& p) { return p.z() - 0.003; }, {40, 40, 20},
                                       {-20, -20, -10}, kVoxel, kTruncation, seen),
                      1);
  ASSERT_GT(surface.mesh.triangles.cols(), 500);
  for (Eigen::Index n = 0; n < surface.mesh.vertices.cols(); ++n) {
    const double reach = surface.mesh.vertices.col(n).head<2>().cwiseAbs().maxCoeff();
    EXPECT_LE(reach, 0.21);
    const bool border = surface.border_vertex[static_cast<std::size_t>(n)] != 0;
    if (reach < 0.21 - 1.5 * kVoxel) {
      EXPECT_FALSE(border);
    }
  }
  EXPECT_GT(borderVertices(surface), 60);
}

TEST(ObservedSurface, HasNoFacesBetweenMatterAndFreeSpace) {
  // A board seen from the front only: its shell ends in free space at the silhouette.
  const auto board = [](const Eigen::Vector3d& p) {
    return p.cwiseAbs().head<2>().maxCoeff() < 0.2 ? p.z() : 1.0;
  };
  const ObservedSurface surface =
      observedSurface(testing::observe(board, {40, 40, 20}, {-20, -20, -10}, kVoxel, kTruncation), 1);
  ASSERT_GT(surface.mesh.triangles.cols(), 500);
  for (Eigen::Index n = 0; n < surface.mesh.vertices.cols(); ++n)
    EXPECT_NEAR(surface.mesh.vertices(2, n), 0.0, 0.5 * kVoxel);
}

TEST(ObservedSurface, DropsSmallPieces) {
  const auto two = [](const Eigen::Vector3d& p) {
    return std::min((p - Eigen::Vector3d(-0.2, 0, 0)).norm() - 0.15,
                    (p - Eigen::Vector3d(0.3, 0, 0)).norm() - 0.05);
  };
  const ObservedGrid grid = testing::observe(two, {50, 40, 40}, {-25, -20, -20}, kVoxel, kTruncation);
  const ObservedSurface all = observedSurface(grid, 1), large = observedSurface(grid, 200);
  EXPECT_GT(all.mesh.vertices.row(0).maxCoeff(), 0.3F);
  EXPECT_LT(large.mesh.vertices.row(0).maxCoeff(), 0.0F);
  EXPECT_EQ(large.mesh.vertices.cols(), large.normals.cols());
  EXPECT_LT(large.mesh.triangles.maxCoeff(), large.mesh.vertices.cols());
}

TEST(ObservedSurface, RefusesArraysThatDoNotFit) {
  ObservedGrid grid = testing::observe(sphere, {10, 10, 10}, {0, 0, 0}, kVoxel, kTruncation);
  grid.state.pop_back();
  EXPECT_THROW(observedSurface(grid, 1), std::invalid_argument);
}

TEST(ExtractSurface, OfAFieldStaysWithinItsMask) {
  SampledField field;
  field.geometry.dims = {40, 40, 40};
  field.geometry.voxel_size = kVoxel;
  field.geometry.T_map_grid.linear() =
      Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  field.geometry.T_map_grid.translation() = Eigen::Vector3d(0.3, -0.7, 1.1);
  const Eigen::Vector3d center = field.geometry.samplePosition({20.3, 19.8, 20.1});
  field.values = DenseTensor(field.geometry.dims);
  field.mask = SupportMask(field.geometry.dims, 4, true);
  for (int k = 0; k < 40; ++k) {
    for (int j = 0; j < 40; ++j) {
      for (int i = 0; i < 40; ++i)
        field.values(i, j, k) = static_cast<float>(
            (field.geometry.samplePosition(Eigen::Vector3d(i, j, k)) - center).norm() - 0.25);
    }
  }
  const SurfaceMesh whole = extractSurface(field);
  ASSERT_GT(whole.triangles.cols(), 1000);
  EXPECT_LT(largestDistance(whole, [&](const Eigen::Vector3d& p) { return (p - center).norm() - 0.25; }),
            0.05 * kVoxel);
  for (int c = 0; c < 10; ++c) {
    for (int b = 0; b < 10; ++b) {
      for (int a = 5; a < 10; ++a) field.mask.set(a, b, c, false);
    }
  }
  const SurfaceMesh half = extractSurface(field);
  ASSERT_GT(half.triangles.cols(), 300);
  for (Eigen::Index n = 0; n < half.vertices.cols(); ++n)
    EXPECT_LT(field.geometry.toIndex(half.vertices.col(n).cast<double>()).x(), 20.0);
}

}  // namespace
}  // namespace ttsdf
