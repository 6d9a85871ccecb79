// Oracles: every solid asked on its own, the signed distance along rays, closed formulas for a few shapes.
#include "ttsdf_localization/simulation/analytic_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "ttsdf_localization/simulation/scene_sampling.h"
#include "ttsdf_localization/simulation/worlds.h"

namespace ttsdf {
namespace {

Eigen::Vector3d randomIn(const Eigen::AlignedBox3d& box, std::mt19937& random) {
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const Eigen::Vector3d s(share(random), share(random), share(random));
  return box.min() + s.cwiseProduct(box.sizes());
}

double bruteDistance(const AnalyticScene& scene, const Eigen::Vector3d& p) {
  double nearest = INFINITY;
  for (const Solid& solid : scene.solids()) nearest = std::min(nearest, solid.signedDistance(p));
  return nearest;
}

TEST(AnalyticScene, DistanceIsTheSmallestOfAllSolids) {
  const AnalyticScene scene = makeApartment();
  std::mt19937 random(1);
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d p = randomIn(scene.bounds(), random);
    ASSERT_DOUBLE_EQ(scene.signedDistance(p), bruteDistance(scene, p)) << p.transpose();
  }
}

TEST(AnalyticScene, DistanceIsExactInFreeSpace) {
  // A ball of that radius about the point touches the scene and does not enter it.
  const AnalyticScene scene = makeRoom();
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d p = randomIn({Eigen::Vector3d::Zero(), Eigen::Vector3d(4.0, 3.0, 2.5)}, random);
    const double distance = scene.signedDistance(p);
    if (distance <= 0.0) continue;
    const Eigen::Vector3d foot = p - distance * scene.gradient(p);
    EXPECT_NEAR(scene.signedDistance(foot), 0.0, 1e-9);
    for (int k = 0; k < 50; ++k) {
      const Eigen::Vector3d d = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
      EXPECT_GE(scene.signedDistance(p + (1.0 - 1e-9) * distance * d), 0.0);
    }
  }
}

TEST(AnalyticScene, DepthInsideIsNeverMoreThanTheTruth) {
  // The segment from an inner point to any free point is longer than the depth.
  const AnalyticScene scene = makeRoom();
  std::mt19937 random(3);
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d inside = randomIn(scene.bounds(), random), other = randomIn(scene.bounds(), random);
    if (scene.signedDistance(inside) >= 0.0 || scene.signedDistance(other) <= 0.0) continue;
    EXPECT_LE(-scene.signedDistance(inside) + scene.signedDistance(other), (inside - other).norm() + 1e-12);
  }
}

TEST(AnalyticScene, RaysEndOnTheFirstSurface) {
  const AnalyticScene scene = makeApartment();
  const Eigen::AlignedBox3d inside(Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(10.0, 8.0, 2.6));
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  int hits = 0;
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d origin = randomIn(inside, random);
    if (scene.signedDistance(origin) <= 0.01) continue;
    const Eigen::Vector3d direction(normal(random), normal(random), normal(random));
    const auto hit = scene.castRay(origin, direction);
    if (!hit) continue;
    ++hits;
    EXPECT_LT(std::abs(scene.signedDistance(hit->point)), 1e-9);
    EXPECT_NEAR((hit->point - origin).norm(), hit->distance, 1e-9);
    EXPECT_LE(hit->normal.dot(direction), 1e-9);
    for (double s = 0.0; s < hit->distance - 1e-6; s += 0.01) {
      ASSERT_GE(scene.signedDistance(origin + s * direction.normalized()), -1e-9);
    }
    // With a limit just short of the surface nothing is hit.
    EXPECT_FALSE(scene.castRay(origin, direction, hit->distance - 1e-6));
    EXPECT_TRUE(scene.castRay(origin, direction, hit->distance + 1e-6));
  }
  EXPECT_GT(hits, 1500);
}

TEST(AnalyticScene, SphereMissesAreFreeAllTheWay) {
  const AnalyticScene scene(std::vector<Solid>{Solid::sphere({0.0, 0.0, 0.0}, 1.0)});
  EXPECT_FALSE(scene.castRay({-3.0, 1.0 + 1e-9, 0.0}, {1.0, 0.0, 0.0}));
  const auto hit = scene.castRay({-3.0, 0.6, 0.0}, {2.0, 0.0, 0.0});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance, 2.2, 1e-12);
  EXPECT_LT((hit->normal - Eigen::Vector3d(-0.8, 0.6, 0.0)).norm(), 1e-12);
}

TEST(AnalyticScene, EmptySceneIsFarEverywhere) {
  const AnalyticScene scene;
  EXPECT_TRUE(std::isinf(scene.signedDistance({0.0, 0.0, 0.0})));
  EXPECT_FALSE(scene.castRay({0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}));
  EXPECT_THROW(scene.castRay({0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}), std::invalid_argument);
}

TEST(SceneSampling, AgreesWithTheDistanceAtEverySample) {
  const AnalyticScene scene = makeApartment();
  const GridGeometry geometry = gridOver(scene.bounds(), 0.11, 0.2);
  const DenseTensor tensor = sampleDistances(scene, geometry);
  for (int k = 0; k < geometry.dims[2]; ++k) {
    for (int j = 0; j < geometry.dims[1]; ++j) {
      for (int i = 0; i < geometry.dims[0]; ++i) {
        const float expected =
            static_cast<float>(scene.signedDistance(geometry.samplePosition({i * 1.0, j * 1.0, k * 1.0})));
        ASSERT_NEAR(tensor(i, j, k), expected, 1e-6f) << i << ' ' << j << ' ' << k;
      }
    }
  }
}

TEST(SceneSampling, PartsAreCutOutOfTheWhole) {
  const AnalyticScene scene = makeRoom();
  const GridGeometry geometry = gridOver(scene.bounds(), 0.1);
  const DenseTensor whole = sampleDistances(scene, geometry);
  const Dims begin(3, 7, 5), size(20, 9, 11);
  DenseTensor part(size);
  sampleDistances(scene, geometry, begin, size, part.data());
  for (int k = 0; k < size[2]; ++k) {
    for (int j = 0; j < size[1]; ++j) {
      for (int i = 0; i < size[0]; ++i) {
        ASSERT_NEAR(part(i, j, k), whole(begin[0] + i, begin[1] + j, begin[2] + k), 1e-6f);
      }
    }
  }
  EXPECT_THROW(sampleDistances(scene, geometry, Dims(-1, 0, 0), size, part.data()), std::invalid_argument);
  EXPECT_THROW(sampleDistances(scene, geometry, geometry.dims - 1, size, part.data()), std::invalid_argument);
  EXPECT_THROW(sampleDistances(AnalyticScene(), geometry), std::invalid_argument);
}

TEST(SceneSampling, GridCoversTheBox) {
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-1.0, 2.0, 0.5), Eigen::Vector3d(1.5, 2.3, 0.57));
  const GridGeometry geometry = gridOver(box, 0.05, 0.1);
  const Eigen::Vector3d first = geometry.samplePosition(Eigen::Vector3d::Zero());
  const Eigen::Vector3d last = geometry.samplePosition((geometry.dims - 1).cast<double>().matrix());
  EXPECT_LT((first - Eigen::Vector3d(-1.1, 1.9, 0.4)).norm(), 1e-12);
  EXPECT_TRUE((last.array() >= Eigen::Array3d(1.6, 2.4, 0.67) - 1e-6).all());
  EXPECT_TRUE((last.array() < Eigen::Array3d(1.6, 2.4, 0.67) + 0.05).all());
  EXPECT_THROW(gridOver(Eigen::AlignedBox3d(), 0.05), std::invalid_argument);
  EXPECT_THROW(gridOver(box, 0.0), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
