// Oracles: points sampled on the surface (brute-force distance), numeric gradients, marching along rays in
// small steps.
#include "ttsdf_localization/simulation/solid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace ttsdf {
namespace {

constexpr double kPi = 3.14159265358979323846;

Eigen::Isometry3d somePose() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.3, -0.5, 0.8).normalized()).toRotationMatrix();
  T.translation() << 0.4, -0.2, 1.1;
  return T;
}

std::vector<Solid> oneOfEach() {
  return {Solid::box(somePose(), {0.6, 1.0, 0.4}), Solid::cylinder(somePose(), 0.35, 0.9),
          Solid::sphere({0.4, -0.2, 1.1}, 0.5)};
}

/// Dense points on the surface, from each shape's own parametrisation.
std::vector<Eigen::Vector3d> surfacePoints(const Solid& solid, int n) {
  const Eigen::Vector3d h = solid.halfExtent();
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      const double a = 2.0 * i / n - 1.0, b = 2.0 * j / n - 1.0, angle = kPi * a;
      if (solid.shape() == SolidShape::kBox) {
        for (int axis = 0; axis < 3; ++axis) {
          for (const double side : {-1.0, 1.0}) {
            Eigen::Vector3d p;
            p[axis] = side;
            p[(axis + 1) % 3] = a;
            p[(axis + 2) % 3] = b;
            points.push_back(p.cwiseProduct(h));
          }
        }
      } else if (solid.shape() == SolidShape::kCylinder) {
        points.emplace_back(h.x() * std::cos(angle), h.x() * std::sin(angle), b * h.z());
        const double r = h.x() * 0.5 * (b + 1.0);
        points.emplace_back(r * std::cos(angle), r * std::sin(angle), h.z());
        points.emplace_back(r * std::cos(angle), r * std::sin(angle), -h.z());
      } else {
        const double polar = 0.5 * kPi * b;
        points.emplace_back(h.x() * std::cos(polar) * std::cos(angle),
                            h.x() * std::cos(polar) * std::sin(angle), h.x() * std::sin(polar));
      }
    }
  }
  for (auto& p : points) p = solid.pose() * p;
  return points;
}

TEST(Solid, DistanceIsThatToTheNearestSurfacePoint) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.5, 1.5);
  for (const Solid& solid : oneOfEach()) {
    const auto surface = surfacePoints(solid, 150);
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector3d p =
          solid.center() + Eigen::Vector3d(uniform(random), uniform(random), uniform(random));
      double brute = 1e9;
      for (const auto& s : surface) brute = std::min(brute, (s - p).norm());
      // The samples lie at most 1.4 cm from any surface point, and never nearer than the surface.
      EXPECT_LE(std::abs(solid.signedDistance(p)), brute + 1e-12);
      EXPECT_GT(std::abs(solid.signedDistance(p)), brute - 0.015);
    }
  }
}

TEST(Solid, DistanceIsNegativeExactlyInside) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (const Solid& solid : oneOfEach()) {
    const Eigen::Vector3d h = solid.halfExtent();
    for (int i = 0; i < 500; ++i) {
      const Eigen::Vector3d p(uniform(random), uniform(random), uniform(random));
      const bool inside = solid.shape() == SolidShape::kBox ? (p.cwiseAbs().array() < h.array()).all()
                          : solid.shape() == SolidShape::kCylinder
                              ? p.head<2>().norm() < h.x() && std::abs(p.z()) < h.z()
                              : p.norm() < h.x();
      EXPECT_EQ(solid.signedDistance(solid.pose() * p) < 0.0, inside);
    }
  }
}

TEST(Solid, NormalIsTheGradientOfTheDistance) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1.2, 1.2);
  constexpr double kStep = 1e-6;
  for (const Solid& solid : oneOfEach()) {
    int compared = 0;
    for (int i = 0; i < 300; ++i) {
      const Eigen::Vector3d p =
          solid.center() + Eigen::Vector3d(uniform(random), uniform(random), uniform(random));
      Eigen::Vector3d numeric;
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d d = kStep * Eigen::Vector3d::Unit(axis);
        numeric[axis] = (solid.signedDistance(p + d) - solid.signedDistance(p - d)) / (2.0 * kStep);
      }
      if (std::abs(numeric.norm() - 1.0) > 1e-6) continue;  // on the medial axis there is none
      ++compared;
      EXPECT_LT((solid.normal(p) - numeric).norm(), 1e-4);
    }
    EXPECT_GT(compared, 280);
  }
}

TEST(Solid, RayHitsTheSurfaceFirstWhereTheDistanceTurnsNegative) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  constexpr double kStep = 2e-3;
  int hits = 0, misses = 0;
  for (const Solid& solid : oneOfEach()) {
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector3d origin =
          solid.center() + 2.0 * Eigen::Vector3d(uniform(random), uniform(random), uniform(random));
      if (solid.signedDistance(origin) <= 0.0) continue;
      const Eigen::Vector3d target =
          solid.center() + 0.7 * Eigen::Vector3d(uniform(random), uniform(random), uniform(random));
      const Eigen::Vector3d direction = (target - origin).normalized();
      const double t = solid.intersect(origin, direction);
      double marched = INFINITY;
      for (double s = 0.0; s < 6.0; s += kStep) {
        if (solid.signedDistance(origin + s * direction) < 0.0) {
          marched = s;
          break;
        }
      }
      if (std::isfinite(t)) {
        ++hits;
        EXPECT_LT(std::abs(solid.signedDistance(origin + t * direction)), 1e-12);
        // A ray that cuts a corner by less than a step may be missed by the march, never the other way round.
        if (std::isfinite(marched)) {
          EXPECT_LE(t, marched);
          EXPECT_GT(t, marched - kStep);
        }
      } else {
        ++misses;
        EXPECT_TRUE(std::isinf(marched));
      }
    }
  }
  EXPECT_GT(hits, 300);
  EXPECT_GT(misses, 50);
}

TEST(Solid, RaysAlongTheAxesAndThroughEdgesAreExact) {
  const Solid box = Solid::box(Eigen::Isometry3d::Identity(), {2.0, 2.0, 2.0});
  EXPECT_DOUBLE_EQ(box.intersect({-3.0, 0.0, 0.0}, {1.0, 0.0, 0.0}), 2.0);
  EXPECT_DOUBLE_EQ(box.intersect({-3.0, 0.5, -0.5}, {0.5, 0.0, 0.0}), 4.0);
  EXPECT_TRUE(std::isinf(box.intersect({-3.0, 1.5, 0.0}, {1.0, 0.0, 0.0})));
  EXPECT_TRUE(std::isinf(box.intersect({-3.0, 0.0, 0.0}, {-1.0, 0.0, 0.0})));
  EXPECT_TRUE(std::isinf(box.intersect({0.0, 0.0, 0.0}, {1.0, 0.0, 0.0})));  // from inside: not seen
  const Solid post = Solid::cylinder(Eigen::Isometry3d::Identity(), 0.5, 2.0);
  EXPECT_DOUBLE_EQ(post.intersect({0.2, 0.0, 4.0}, {0.0, 0.0, -1.0}), 3.0);
  EXPECT_TRUE(std::isinf(post.intersect({0.6, 0.0, 4.0}, {0.0, 0.0, -1.0})));
  EXPECT_DOUBLE_EQ(post.intersect({-2.0, 0.0, 0.9}, {1.0, 0.0, 0.0}), 1.5);
  EXPECT_TRUE(std::isinf(post.intersect({-2.0, 0.0, 1.1}, {1.0, 0.0, 0.0})));
}

TEST(Solid, BoundingBoxHoldsTheSurfaceTightly) {
  for (const Solid& solid : oneOfEach()) {
    const Eigen::AlignedBox3d box = solid.boundingBox();
    Eigen::AlignedBox3d seen;
    for (const auto& p : surfacePoints(solid, 60)) {
      EXPECT_LT(box.exteriorDistance(p), 1e-12);
      EXPECT_LE((p - solid.center()).norm(), solid.boundingRadius() + 1e-12);
      seen.extend(p);
    }
    if (solid.shape() == SolidShape::kBox) {
      EXPECT_LT((box.sizes() - seen.sizes()).norm(), 1e-12);
    }
  }
}

TEST(Solid, RefusesSizesAndPosesThatAreNone) {
  const Eigen::Isometry3d I = Eigen::Isometry3d::Identity();
  EXPECT_THROW(Solid::box(I, {1.0, 0.0, 1.0}), std::invalid_argument);
  EXPECT_THROW(Solid::box(I, {1.0, NAN, 1.0}), std::invalid_argument);
  EXPECT_THROW(Solid::cylinder(I, -1.0, 1.0), std::invalid_argument);
  EXPECT_THROW(Solid::sphere({0.0, 0.0, 0.0}, INFINITY), std::invalid_argument);
  EXPECT_THROW(Solid::sphere({NAN, 0.0, 0.0}, 1.0), std::invalid_argument);
  Eigen::Isometry3d scaled = I;
  scaled.linear() *= 2.0;
  EXPECT_THROW(Solid::box(scaled, {1.0, 1.0, 1.0}), std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
