// The apartment: a floor plan and the furniture of each room. x to the right, y up the page:
//
//   8.0 +-----------+------+---------+
//       |  bedroom  | bath |  study  |
//   5.4 +----d------+--d---+---d-----+
//       |          corridor          |
//   4.2 +-----d--------+----d--------+
//       |    living    o   kitchen   |
//   0.0 +--------------+-------------+
//       0     4.4     5.4  6.8      10
#include <cmath>

#include "headings.h"
#include "tours.h"
#include "ttsdf_localization/simulation/scene_builder.h"
#include "ttsdf_localization/simulation/worlds.h"

namespace ttsdf {

namespace {

constexpr double kHeight = 2.6;
constexpr double kOuter = 0.25, kInner = 0.12;  // wall thickness [m]
constexpr double kHalf = 0.5 * kInner;
constexpr double kDoor = 2.05;

void addShell(SceneBuilder& b) {
  b.box({-kOuter, -kOuter, -0.20}, {10.0 + kOuter, 8.0 + kOuter, 0.0});
  b.box({-kOuter, -kOuter, kHeight}, {10.0 + kOuter, 8.0 + kOuter, kHeight + 0.15});
  const double o = 0.5 * kOuter;
  b.wall({-o, -o}, {10.0 + o, -o}, 0.0, kHeight, kOuter,
         {{1.0 + o, 2.6 + o, 0.9, 2.2}, {3.5 + o, 4.5 + o, 0.1, 2.2}, {7.0 + o, 8.4 + o, 1.1, 2.2}});
  b.wall({10.0 + o, -o}, {10.0 + o, 8.0 + o}, 0.0, kHeight, kOuter, {{6.2 + o, 7.4 + o, 0.9, 2.1}});
  b.wall({-o, 8.0 + o}, {10.0 + o, 8.0 + o}, 0.0, kHeight, kOuter,
         {{1.2 + o, 2.8 + o, 1.0, 2.2}, {5.3 + o, 5.9 + o, 1.5, 2.2}});
  b.wall({-o, -o}, {-o, 8.0 + o}, 0.0, kHeight, kOuter, {{1.7 + o, 2.7 + o, 0.9, 2.2}});
  b.wall({0.0, 4.2}, {10.0, 4.2}, 0.0, kHeight, kInner, {{2.2, 3.1, 0.0, kDoor}, {7.4, 8.3, 0.0, kDoor}});
  b.wall({0.0, 5.4}, {10.0, 5.4}, 0.0, kHeight, kInner,
         {{1.2, 2.1, 0.0, kDoor}, {5.2, 6.0, 0.0, kDoor}, {8.2, 9.1, 0.0, kDoor}});
  b.wall({5.4, 0.0}, {5.4, 4.2}, 0.0, kHeight, kInner, {{1.2, 2.6, 0.0, 2.2}});
  b.wall({4.4, 5.4}, {4.4, 8.0}, 0.0, kHeight, kInner);
  b.wall({6.8, 5.4}, {6.8, 8.0}, 0.0, kHeight, kInner);
}

void addCeilingLamp(SceneBuilder& b, double x, double y, double radius) {
  b.post({x, y, 2.2, 0.0}, 0.015, kHeight - 2.2 + SceneBuilder::kEmbed);
  b.post({x, y, 2.14, 0.0}, radius, 0.12);
}

/// Open door leaf, hinged at (x, y), pointing along `yaw`.
void addDoorLeaf(SceneBuilder& b, double x, double y, double yaw) {
  constexpr double kWidth = 0.82, kTop = 2.0;
  const Eigen::Vector2d middle =
      Eigen::Vector2d(x, y) + 0.5 * kWidth * Eigen::Vector2d(std::cos(yaw), std::sin(yaw));
  b.turnedBox({middle.x(), middle.y(), 0.5 * kTop + 0.01}, {kWidth, 0.04, kTop}, {0.0, 0.0, yaw});
}

void addLivingRoom(SceneBuilder& b) {
  b.shelf({0.17, 0.80, 0.0, kEast}, {0.36, 1.2, 2.1}, 5, 1);
  b.shelf({0.15, 3.50, 0.0, kEast}, {0.32, 0.9, 1.7}, 4, 2);
  b.table({1.7, 1.6, 0.0, 0.35}, {0.9, 1.5, 0.75});
  b.chair({1.05, 1.75, 0.0, -0.1});
  b.chair({0.95, 1.15, 0.0, 0.4});
  b.chair({2.35, 1.50, 0.0, 3.3});
  b.chair({2.20, 2.15, 0.0, 3.9});
  b.sofa({4.2, 1.35, 0.0, kNorth}, 2.1);
  b.table({4.2, 2.65, 0.0, kNorth + 0.1}, {0.6, 1.0, 0.42});
  b.cabinet({4.3, 3.92, 0.0, kSouth}, {0.46, 1.5, 0.5}, 3);
  b.panel({4.3, 4.2 - kHalf, 0.75, kSouth}, 1.2, 0.7);
  b.panel({5.4 - kHalf, 3.4, 1.35, kWest}, 0.6, 0.8);
  b.panel({0.9, 4.2 - kHalf, 1.4, kSouth}, 0.9, 0.5);
  b.panel({3.05, 0.0, 1.2, kNorth}, 0.4, 0.9);
  b.lamp({2.95, 0.35, 0.0, 0.0}, 1.75);
  b.plant({5.0, 0.42, 0.0, 0.0}, 1.3);
  b.radiator({1.8, 0.0, 0.0, kNorth}, 1.2);
  b.radiator({0.0, 2.2, 0.0, kEast}, 0.8);
  addCeilingLamp(b, 1.7, 1.6, 0.22);
  addCeilingLamp(b, 4.2, 2.5, 0.3);
  addDoorLeaf(b, 2.2, 4.2 - kHalf, kSouth - 1.15);
  b.box({3.2, 0.0 - SceneBuilder::kEmbed, 2.42}, {3.4, 4.2, kHeight + SceneBuilder::kEmbed});  // ceiling beam
}

void addKitchen(SceneBuilder& b) {
  b.cabinet({8.1, 0.29, 0.0, kNorth}, {0.62, 3.86, 0.9}, 6);
  b.cabinet({9.69, 1.75, 0.0, kWest}, {0.64, 2.4, 0.9}, 4);
  b.cabinet({9.84, 0.85, 1.45, kWest}, {0.38, 1.0, 0.7}, 2);
  b.cabinet({9.84, 2.45, 1.45, kWest}, {0.38, 0.8, 0.7}, 2);
  b.cabinet({9.1, 0.15, 1.45, kNorth}, {0.38, 1.2, 0.7}, 3);
  b.box({9.5, 1.45, 1.6}, {10.05, 2.0, 1.72});  // hood
  b.box({9.7, 1.6, 1.68}, {10.05, 1.85, kHeight + SceneBuilder::kEmbed});
  b.cabinet({9.66, 3.55, 0.0, kWest}, {0.70, 0.66, 1.9}, 1);
  b.post({7.7, 0.14, 0.85, 0.0}, 0.025, 0.35);  // tap
  b.box({7.68, 0.14, 1.16}, {7.72, 0.34, 1.19});
  b.boxAt({6.55, 0.25, 0.85, 0.2}, {0.25, 0.3, 0.35});  // coffee machine
  b.post({6.45, 3.35, 0.68, 0.0}, 0.5, 0.05);           // round table
  b.post({6.45, 3.35, -SceneBuilder::kEmbed, 0.0}, 0.06, 0.75);
  b.post({6.45, 3.35, -SceneBuilder::kEmbed, 0.0}, 0.28, 0.08);
  b.post({6.0, 2.85, -SceneBuilder::kEmbed, 0.0}, 0.18, 0.52);
  b.post({7.0, 3.0, -SceneBuilder::kEmbed, 0.0}, 0.18, 0.52);
  b.sphere({6.4, 3.4, 0.80}, 0.09);
  b.panel({6.6, 4.2 - kHalf, 1.3, kSouth}, 0.7, 0.7);
  b.panel({5.4 + kHalf, 3.4, 1.5, kEast}, 0.3, 0.4);
  b.shelf({5.4 + kHalf + 0.10, 0.6, 1.2, kEast}, {0.25, 0.8, 0.7}, 2, 5);
  addCeilingLamp(b, 7.6, 1.9, 0.25);
  b.sphere({6.45, 3.35, 2.1}, 0.16);
  b.post({6.45, 3.35, 2.2, 0.0}, 0.012, 0.45);
}

void addCorridor(SceneBuilder& b) {
  b.panel({0.0, 4.8, -SceneBuilder::kEmbed, kEast}, 0.95, 2.1);  // closed entrance door
  b.boxAt({0.05, 5.12, 1.0, 0.0}, {0.12, 0.04, 0.04});
  b.cabinet({3.7, 5.4 - kHalf - 0.10, 0.0, kSouth}, {0.24, 1.0, 1.0}, 2);
  b.cabinet({9.73, 4.8, 0.0, kWest}, {0.58, 0.9, 2.05}, 2);
  b.panel({4.5, 4.2 + kHalf, 0.5, kNorth}, 0.5, 1.4);
  b.panel({6.1, 4.2 + kHalf, 1.4, kNorth}, 0.5, 0.4);
  b.cabinet({8.85, 4.2 + kHalf + 0.08, 0.9, kNorth}, {0.2, 0.5, 0.5}, 1);
  b.panel({9.25, 5.4 - kHalf, 1.0, kSouth}, 0.25, 0.8);
  b.panel({7.3, 5.4 - kHalf, 1.35, kSouth}, 0.8, 0.5);
  b.panel({2.9, 5.4 - kHalf, 1.5, kSouth}, 0.35, 0.35);
  b.post({6.9, 4.2 + kHalf, -SceneBuilder::kEmbed, 0.0}, 0.12, kHeight + 2.0 * SceneBuilder::kEmbed);
  b.box({0.5, 5.4 - kHalf - 0.06, 1.68}, {1.05, 5.4, 1.74});  // coats
  b.turnedBox({0.65, 5.4 - kHalf - 0.08, 1.3}, {0.18, 0.12, 0.8}, {0.05, 0.0, 0.1});
  b.turnedBox({0.92, 5.4 - kHalf - 0.07, 1.35}, {0.16, 0.1, 0.7}, {0.03, 0.0, -0.15});
  addCeilingLamp(b, 1.6, 4.8, 0.15);
  addCeilingLamp(b, 4.9, 4.8, 0.15);
  b.box({6.3, 4.2, 2.35}, {6.5, 5.4, kHeight + SceneBuilder::kEmbed});  // lintel across the corridor
}

void addBedroom(SceneBuilder& b) {
  b.bed({1.06, 7.05, 0.0, kEast}, 1.6);
  b.cabinet({0.2, 5.98, 0.0, kEast}, {0.42, 0.4, 0.5}, 1);
  b.sphere({0.2, 5.98, 0.62}, 0.14);
  b.cabinet({4.4 - kHalf - 0.29, 6.95, 0.0, kWest}, {0.62, 2.0, 2.2}, 4);
  b.cabinet({3.2, 5.4 + kHalf + 0.18, 0.0, kNorth}, {0.4, 1.0, 0.85}, 3);
  b.panel({3.2, 5.4 + kHalf, 1.1, kNorth}, 0.8, 0.9);
  b.panel({0.0, 7.05, 1.45, kEast}, 1.1, 0.6);
  b.radiator({2.0, 8.0, 0.0, kSouth}, 1.2);
  b.lamp({3.3, 7.7, 0.0, 0.0}, 1.6);
  addCeilingLamp(b, 2.2, 6.7, 0.28);
  addDoorLeaf(b, 1.2, 5.4 + kHalf, kNorth + 0.3);
}

void addBath(SceneBuilder& b) {
  constexpr double kFloor = -SceneBuilder::kEmbed, kRim = 0.56;
  const double west = 4.4, north = 8.0 + SceneBuilder::kEmbed;  // the tub reaches into the walls
  b.box({west, 7.22, kFloor}, {6.1, 7.30, kRim});
  b.box({west, 7.92, kFloor}, {6.1, north, kRim});
  b.box({west, 7.22, kFloor}, {4.56, north, kRim});
  b.box({6.0, 7.22, kFloor}, {6.1, north, kRim});
  b.box({west, 7.22, kFloor}, {6.1, north, 0.14});
  b.boxAt({6.41, 7.68, kFloor, 0.0}, {0.6, 0.6, 0.9});  // washing machine
  b.cabinet({6.8 - kHalf - 0.2, 6.45, 0.0, kWest}, {0.46, 0.8, 0.80}, 2);
  b.post({6.5, 6.45, 0.78, 0.0}, 0.2, 0.1);  // basin
  b.panel({6.8 - kHalf, 6.45, 1.15, kWest}, 0.7, 0.8);
  b.post({4.85, 6.35, kFloor, 0.0}, 0.19, 0.47);  // toilet
  b.box({4.4, 6.15, 0.3}, {4.66, 6.55, 0.85});
  b.radiator({4.4 + kHalf, 5.75, 0.8, kEast}, 0.4);
  addCeilingLamp(b, 5.6, 6.7, 0.18);
}

void addStudy(SceneBuilder& b) {
  b.table({9.62, 6.8, 0.0, kWest}, {0.74, 1.5, 0.74});
  b.turnedBox({9.75, 6.9, 1.02}, {0.04, 0.62, 0.38}, {0.0, -0.1, 0.2});  // monitor on its foot
  b.boxAt({9.78, 6.9, 0.72, 0.2}, {0.08, 0.12, 0.2});
  b.chair({9.05, 6.75, 0.0, 0.3});
  b.shelf({7.8, 7.84, 0.0, kSouth}, {0.34, 1.7, 2.2}, 6, 3);
  b.shelf({9.2, 7.88, 1.0, kSouth}, {0.26, 0.9, 0.9}, 3, 4);
  b.cabinet({9.2, 7.78, 0.0, kSouth}, {0.46, 0.8, 0.7}, 2);
  b.post({7.2, 5.8, -SceneBuilder::kEmbed, 0.0}, 0.04, 0.9);  // globe
  b.post({7.2, 5.8, -SceneBuilder::kEmbed, 0.0}, 0.18, 0.08);
  b.sphere({7.2, 5.8, 1.0}, 0.2);
  b.turnedBox({7.0, 6.9, 0.65}, {0.03, 0.8, 1.4}, {0.0, 0.12, 0.0});  // board leaning at the wall
  b.panel({6.8 + kHalf, 6.2, 1.5, kEast}, 0.5, 0.5);
  b.radiator({10.0, 6.8, 0.0, kWest}, 1.0);
  addCeilingLamp(b, 8.4, 6.7, 0.24);
  addDoorLeaf(b, 9.1, 5.4 + kHalf, kNorth - 0.2);
}

}  // namespace

AnalyticScene makeApartment() {
  SceneBuilder b;
  addShell(b);
  addLivingRoom(b);
  addKitchen(b);
  addCorridor(b);
  addBedroom(b);
  addBath(b);
  addStudy(b);
  return b.build();
}

std::vector<Waypoint> apartmentTour() {
  return {
      {{1.0, 4.80, 1.40}, {4.0, 4.8, 1.2}},   // corridor, east
      {{2.5, 4.75, 1.40}, {2.8, 3.0, 1.2}},   //
      {{2.65, 3.7, 1.35}, {2.2, 1.5, 1.0}},   // living room
      {{1.3, 3.10, 1.35}, {0.0, 1.2, 1.0}},   //
      {{0.9, 2.35, 1.40}, {1.8, 0.0, 1.0}},   //
      {{2.3, 0.90, 1.45}, {4.6, 0.6, 0.8}},   //
      {{3.1, 2.10, 1.40}, {5.2, 0.8, 0.8}},   //
      {{3.5, 2.50, 1.35}, {4.3, 4.1, 0.9}},   //
      {{4.5, 2.15, 1.35}, {7.0, 2.2, 1.1}},   //
      {{5.4, 1.95, 1.40}, {8.0, 1.6, 1.1}},   // kitchen
      {{6.6, 1.80, 1.40}, {8.3, 0.2, 1.1}},   //
      {{7.7, 1.60, 1.40}, {10.0, 1.2, 1.1}},  //
      {{8.3, 2.40, 1.35}, {10.0, 3.2, 1.1}},  //
      {{7.7, 2.90, 1.35}, {6.2, 3.5, 0.9}},   //
      {{7.85, 3.6, 1.35}, {7.9, 5.4, 1.2}},   //
      {{7.9, 4.65, 1.40}, {9.8, 4.9, 1.1}},   // corridor
      {{8.5, 4.95, 1.40}, {8.6, 7.0, 1.1}},   //
      {{8.6, 5.80, 1.35}, {8.0, 7.8, 1.1}},   // study
      {{8.3, 6.50, 1.35}, {9.9, 7.2, 1.0}},   //
      {{7.9, 6.80, 1.40}, {9.6, 5.6, 1.0}},   //
      {{7.6, 6.40, 1.40}, {6.9, 5.7, 1.1}},   //
      {{8.4, 6.00, 1.40}, {8.6, 4.4, 1.2}},   //
      {{8.6, 5.30, 1.40}, {8.0, 4.2, 1.2}},   //
      {{7.9, 4.80, 1.40}, {5.0, 4.7, 1.2}},   // corridor, west
      {{6.4, 4.78, 1.40}, {5.4, 6.2, 1.1}},   //
      {{5.6, 5.10, 1.35}, {5.5, 7.5, 0.9}},   // bath
      {{5.6, 6.00, 1.35}, {5.4, 7.9, 0.7}},   //
      {{5.4, 6.60, 1.40}, {6.8, 6.6, 0.9}},   //
      {{5.5, 6.30, 1.40}, {5.0, 4.6, 1.0}},   //
      {{5.6, 5.40, 1.40}, {4.0, 4.5, 1.0}},   //
      {{5.0, 4.82, 1.40}, {3.0, 4.9, 1.2}},   // corridor
      {{3.0, 4.75, 1.40}, {1.6, 5.6, 1.1}},   //
      {{1.75, 5.05, 1.4}, {1.7, 7.0, 0.9}},   // bedroom
      {{1.7, 5.90, 1.35}, {1.4, 7.6, 0.6}},   //
      {{2.6, 6.10, 1.35}, {4.3, 7.2, 1.1}},   //
      {{2.9, 6.70, 1.40}, {1.0, 7.9, 0.9}},   //
      {{2.5, 6.50, 1.40}, {0.3, 6.2, 0.9}},   //
      {{2.1, 6.05, 1.40}, {3.2, 5.5, 1.1}},   //
      {{1.75, 5.5, 1.40}, {2.8, 4.3, 1.1}},   //
      {{1.45, 4.95, 1.4}, {3.5, 4.5, 1.1}},   // corridor
  };
}

}  // namespace ttsdf
