#include "ttsdf_localization/simulation/worlds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "ttsdf_localization/simulation/scene_builder.h"
#include "ttsdf_localization/simulation/scene_sampling.h"

namespace ttsdf {
namespace {

/// A random point on the surface of a box or cylinder or sphere, with its outward normal.
std::pair<Eigen::Vector3d, Eigen::Vector3d> onSurface(const Solid& solid, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::normal_distribution<double> normal;
  const Eigen::Vector3d d = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
  if (solid.shape() == SolidShape::kBox) {
    Eigen::Vector3d p(uniform(random), uniform(random), uniform(random));
    const int axis = static_cast<int>(random() % 3);
    p[axis] = p[axis] < 0.0 ? -1.0 : 1.0;
    const Eigen::Vector3d n = Eigen::Vector3d::Unit(axis) * p[axis];
    return {solid.pose() * p.cwiseProduct(solid.halfExtent()), solid.pose().linear() * n};
  }
  if (solid.shape() == SolidShape::kCylinder) {
    const Eigen::Vector3d n = Eigen::Vector3d(d.x(), d.y(), 0.0).normalized();
    const Eigen::Vector3d p =
        solid.halfExtent().x() * n + uniform(random) * solid.halfExtent().z() * Eigen::Vector3d::UnitZ();
    return {solid.pose() * p, solid.pose().linear() * n};
  }
  return {solid.center() + solid.halfExtent().x() * d, d};
}

class EveryWorld : public testing::TestWithParam<std::string> {};

TEST_P(EveryWorld, HasNoSeamsInsideMatter) {
  // Where the distance is zero on a solid's surface, there must be free space in front of it.
  const AnalyticScene scene = makeWorld(GetParam()).scene;
  std::mt19937 random(7);
  for (std::size_t s = 0; s < scene.solids().size(); ++s) {
    for (int i = 0; i < 200; ++i) {
      const auto [p, n] = onSurface(scene.solids()[s], random);
      if (scene.signedDistance(p) < -1e-9) continue;  // covered by another solid
      EXPECT_GT(scene.signedDistance(p + 1e-5 * n), 1e-7)
          << "solid " << s << " touches another one at " << p.transpose() << ", normal " << n.transpose();
    }
  }
}

TEST_P(EveryWorld, IsTheSameEveryTime) {
  const World a = makeWorld(GetParam()), b = makeWorld(GetParam());
  ASSERT_EQ(a.scene.solids().size(), b.scene.solids().size());
  for (std::size_t i = 0; i < a.scene.solids().size(); ++i) {
    EXPECT_EQ(a.scene.solids()[i].pose().matrix(), b.scene.solids()[i].pose().matrix());
    EXPECT_EQ(a.scene.solids()[i].halfExtent(), b.scene.solids()[i].halfExtent());
  }
}

TEST_P(EveryWorld, LeavesRoomForTheCamera) {
  const World world = makeWorld(GetParam());
  const Trajectory trajectory(world.tour, world.closed);
  for (const StampedPose& stamped : trajectory.sample(20.0)) {
    const Eigen::Vector3d p = stamped.T_map_base.translation();
    ASSERT_GT(world.scene.signedDistance(p), 0.2) << p.transpose() << " at " << stamped.time << " s";
  }
}

TEST_P(EveryWorld, GivesTheCameraSomethingToSee) {
  // From everywhere on the tour at least a quarter of the forward rays ends within 5 m.
  const World world = makeWorld(GetParam());
  for (const StampedPose& stamped : Trajectory(world.tour, world.closed).sample(2.0)) {
    int hits = 0, rays = 0;
    for (double y = -0.4; y <= 0.41; y += 0.1) {
      for (double z = -0.3; z <= 0.31; z += 0.1) {
        ++rays;
        const Eigen::Vector3d direction = stamped.T_map_base.linear() * Eigen::Vector3d(1.0, y, z);
        if (world.scene.castRay(stamped.T_map_base.translation(), direction, 5.0)) ++hits;
      }
    }
    EXPECT_GT(hits, rays / 4) << "at " << stamped.time << " s";
  }
}

INSTANTIATE_TEST_SUITE_P(Worlds, EveryWorld, testing::ValuesIn(worldNames()),
                         [](const auto& param) { return param.param; });

TEST(Worlds, UnknownNameIsRefused) { EXPECT_THROW(makeWorld("castle"), std::invalid_argument); }

TEST(Worlds, ApartmentRoomsAreConnectedByDoors) {
  const AnalyticScene scene = makeApartment();
  EXPECT_GT(scene.signedDistance({2.65, 4.2, 1.0}), 0.3);  // living room - corridor
  EXPECT_GT(scene.signedDistance({5.4, 1.9, 1.0}), 0.3);   // living room - kitchen
  EXPECT_GT(scene.signedDistance({7.85, 4.2, 1.0}), 0.3);  // kitchen - corridor
  EXPECT_LT(scene.signedDistance({5.0, 4.2, 1.0}), 0.0);   // wall
  EXPECT_LT(scene.signedDistance({2.65, 4.2, 2.3}), 0.0);  // lintel
  EXPECT_GT(scene.signedDistance({1.8, -0.1, 1.5}), 0.0);  // window
  EXPECT_LT(scene.signedDistance({1.8, -0.1, 0.5}), 0.0);  // below it
}

TEST(Worlds, BuildingFillsTheGridOfTheLargestScene) {
  const GridGeometry geometry = gridOver(makeBuilding().bounds(), 0.02);
  EXPECT_EQ(geometry.dims[0], 736);
  EXPECT_EQ(geometry.dims[1], 934);
  EXPECT_EQ(geometry.dims[2], 309);
}

TEST(SceneBuilder, WallWithOpeningsIsTheWallMinusTheOpenings) {
  SceneBuilder builder;
  const std::vector<WallOpening> openings = {
      {1.0, 1.9, 0.0, 2.0}, {2.5, 3.5, 0.9, 2.1}, {3.0, 4.2, 0.4, 1.2}};
  builder.wall({0.5, 0.5}, {3.5, 4.5}, 0.2, 2.8, 0.2, openings);
  const AnalyticScene scene = builder.build();
  const Eigen::Vector3d along(0.6, 0.8, 0.0);
  for (double s = 0.013; s < 5.0; s += 0.05) {
    for (double z = 0.013; z < 2.6; z += 0.05) {
      bool open = false;
      for (const auto& o : openings) open = open || (s > o.begin && s < o.end && z > o.bottom && z < o.top);
      const Eigen::Vector3d p = Eigen::Vector3d(0.5, 0.5, 0.2 + z) + s * along;
      EXPECT_EQ(scene.signedDistance(p) > 0.0, open) << "s " << s << " z " << z;
    }
  }
  EXPECT_THROW(builder.wall({0.0, 0.0}, {2.0, 0.0}, 0.0, 2.5, 0.1, {{1.5, 2.5, 0.0, 2.0}}),
               std::invalid_argument);
  EXPECT_THROW(builder.wall({0.0, 0.0}, {2.0, 0.0}, 0.0, 2.5, 0.1, {{0.5, 1.5, 1.0, 0.5}}),
               std::invalid_argument);
}

}  // namespace
}  // namespace ttsdf
