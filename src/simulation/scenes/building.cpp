// The building: two storeys with a corridor along y, four rooms on either side of it, and stairs at its
// northern end.
#include <algorithm>
#include <array>
#include <cmath>

#include "headings.h"
#include "tours.h"
#include "ttsdf_localization/simulation/scene_builder.h"
#include "ttsdf_localization/simulation/worlds.h"

namespace ttsdf {

namespace {

constexpr double kLengthX = 14.70, kLengthY = 18.66;
constexpr double kSlab = 0.20, kClear = 2.78, kStorey = kSlab + kClear;  // 3 slabs + 2 clear heights = 6.16 m
constexpr double kFacade = 0.30, kPartition = 0.14;
constexpr double kWestWall = 6.35, kEastWall = 8.35;  // the corridor's walls
constexpr double kDoorWidth = 0.95, kDoorHeight = 2.1;
constexpr double kStairsY = 12.4, kStairsRun = 0.28, kStairsX = 7.85;
constexpr int kStairsSteps = 16;

/// Room borders along y: outer faces and three cross walls, different in every row of rooms.
using Cuts = std::array<double, 5>;

Cuts cuts(int storey, bool east) {
  const double shift = (storey == 0 ? 0.0 : 0.7) + (east ? -0.5 : 0.0);
  return {kFacade, 4.9 + shift, 9.2 + shift, 13.6 + 0.5 * shift, kLengthY - kFacade};
}

struct Room {
  double x_min, x_max, y_min, y_max, floor;
  double door_y;  ///< middle of the door in the corridor's wall
  bool east;
  int number;
};

std::vector<Room> rooms() {
  std::vector<Room> all;
  for (int storey = 0; storey < 2; ++storey) {
    for (const bool east : {false, true}) {
      const Cuts y = cuts(storey, east);
      for (std::size_t i = 0; i + 1 < y.size(); ++i) {
        Room room{};
        room.x_min = east ? kEastWall : kFacade;
        room.x_max = east ? kLengthX - kFacade : kWestWall;
        room.y_min = y[i];
        room.y_max = y[i + 1];
        room.floor = storey * kStorey;
        room.number = static_cast<int>(all.size());
        // The stairs stand before the last eastern room: its door is beyond them.
        const bool behind_stairs = east && i + 2 == y.size();
        room.door_y = behind_stairs ? room.y_max - 0.75 : y[i] + 1.2 + 0.3 * (room.number % 4);
        room.east = east;
        all.push_back(room);
      }
    }
  }
  return all;
}

/// A slab over the whole plan, with a hole over the stairs if wanted; the pieces around the hole overlap.
void addSlab(SceneBuilder& b, double bottom, bool hole) {
  const double top = bottom + kSlab;
  if (!hole) {
    b.box({0.0, 0.0, bottom}, {kLengthX, kLengthY, top});
    return;
  }
  const double x0 = kStairsX - 0.5, x1 = kEastWall - 0.5 * kPartition;
  const double y0 = kStairsY + 0.6, y1 = kStairsY + kStairsRun * kStairsSteps - SceneBuilder::kEmbed;
  b.box({0.0, 0.0, bottom}, {x0, kLengthY, top});
  b.box({x1, 0.0, bottom}, {kLengthX, kLengthY, top});
  b.box({0.0, 0.0, bottom}, {kLengthX, y0, top});
  b.box({0.0, y1, bottom}, {kLengthX, kLengthY, top});
}

void addOuterWalls(SceneBuilder& b, int storey) {
  const double floor = storey * kStorey, top = floor + kClear, h = 0.5 * kFacade;
  const Eigen::Vector2d south_west(h, h), south_east(kLengthX - h, h);
  const Eigen::Vector2d north_west(h, kLengthY - h), north_east(kLengthX - h, kLengthY - h);
  std::vector<WallOpening> windows;
  for (int i = 0; i < 4; ++i) {
    const double from = 2.0 + 4.4 * i + 0.3 * storey;
    windows.push_back({from, from + 1.2 + 0.2 * (i % 2), 0.9, 2.2});
  }
  b.wall(south_west, north_west, floor, top, kFacade, windows);
  b.wall(south_east, north_east, floor, top, kFacade, windows);
  b.wall(south_west, south_east, floor, top, kFacade, {{6.8, 7.6, 0.5, 2.3}});
  b.wall(north_west, north_east, floor, top, kFacade, {{2.0, 3.4, 1.0, 2.2}});
}

void addInnerWalls(SceneBuilder& b, int storey) {
  const double floor = storey * kStorey, top = floor + kClear, start = 0.5 * kFacade;
  for (const bool east : {false, true}) {
    const double x = east ? kEastWall : kWestWall;
    std::vector<WallOpening> doors;
    for (const Room& room : rooms()) {
      if (room.east != east || room.floor != floor) continue;
      const double middle = room.door_y - start;
      doors.push_back({middle - 0.5 * kDoorWidth, middle + 0.5 * kDoorWidth, 0.0, kDoorHeight});
    }
    b.wall({x, start}, {x, kLengthY - start}, floor, top, kPartition, doors);
    const Cuts y = cuts(storey, east);
    for (std::size_t i = 1; i + 1 < y.size(); ++i) {
      b.wall({east ? x : start, y[i]}, {east ? kLengthX - start : x, y[i]}, floor, top, kPartition);
    }
  }
}

/// Furniture along the wall away from the door and in the middle, different in each room.
void furnish(SceneBuilder& b, const Room& r) {
  const int n = r.number;
  const double far_x = r.east ? r.x_max : r.x_min, facing = r.east ? kWest : kEast,
               inward = r.east ? -1.0 : 1.0;
  const double middle_x = 0.5 * (r.x_min + r.x_max), middle_y = 0.5 * (r.y_min + r.y_max);
  const double yaw = 0.2 * (n % 5) - 0.4, inner = 0.5 * kPartition;
  b.shelf({far_x + inward * 0.18, r.y_max - 1.1, r.floor, facing}, {0.4, 1.1 + 0.1 * (n % 3), 1.9}, 3 + n % 3,
          n);
  b.radiator({far_x, r.y_min + 1.9, r.floor, facing}, 0.9);
  b.cabinet({middle_x + 1.2, r.y_max - inner - 0.2, r.floor, kSouth},
            {0.45, 1.2 + 0.15 * (n % 4), 0.8 + 0.2 * (n % 5)}, 2 + n % 3);
  b.panel({middle_x - 0.9, r.y_max - inner, r.floor + 1.3, kSouth}, 0.5 + 0.1 * (n % 4), 0.5);
  b.panel({middle_x + 0.5 - 0.3 * (n % 3), r.y_min + inner, r.floor + 1.2, kNorth}, 0.9, 0.6);
  b.post({middle_x, middle_y, r.floor + 2.3, 0.0}, 0.2 + 0.03 * (n % 4), kClear - 2.3 + SceneBuilder::kEmbed);
  switch (n % 4) {
    case 0:
      b.table({middle_x, middle_y, r.floor, yaw}, {0.8, 1.6, 0.74});
      b.chair({middle_x - 0.75, middle_y, r.floor, yaw});
      b.chair({middle_x + 0.8, middle_y + 0.3, r.floor, yaw + kPi});
      break;
    case 1:
      b.sofa({middle_x, middle_y + 0.6, r.floor, kSouth + yaw}, 2.0);
      b.table({middle_x, middle_y - 0.6, r.floor, yaw}, {0.6, 0.9, 0.42});
      break;
    case 2:
      b.bed({middle_x + inward * -1.0, middle_y + 0.3, r.floor, facing}, 1.2 + 0.1 * (n % 3));
      b.lamp({middle_x + 1.6, r.y_min + 0.5, r.floor, 0.0}, 1.6);
      break;
    default:
      b.post({middle_x, middle_y, r.floor + 0.70, 0.0}, 0.7, 0.05);
      b.post({middle_x, middle_y, r.floor - SceneBuilder::kEmbed, 0.0}, 0.08, 0.78);
      b.plant({middle_x - 1.6, r.y_min + 0.5, r.floor, 0.0}, 1.4);
      b.turnedBox({middle_x + 1.5, middle_y, r.floor + 0.4}, {0.5, 0.4, 0.9}, {0.2, 0.1, yaw});
  }
}

}  // namespace

AnalyticScene makeBuilding() {
  SceneBuilder b;
  addSlab(b, -kSlab, false);
  addSlab(b, kClear, true);
  addSlab(b, kStorey + kClear, false);
  for (int storey = 0; storey < 2; ++storey) {
    addOuterWalls(b, storey);
    addInnerWalls(b, storey);
  }
  b.stairs({kStairsX, kStairsY, 0.0, kNorth}, 0.9, kStairsRun, kStorey / kStairsSteps, kStairsSteps);
  b.panel({kWestWall + 0.5 * kPartition, 8.0, 1.2, kEast}, 1.2, 0.8);
  b.cabinet({kEastWall - 0.25, 0.9, 0.0, kWest}, {0.4, 0.8, 1.2}, 2);
  b.plant({kWestWall + 0.4, 18.0, 0.0, 0.0}, 1.2);
  b.plant({kWestWall + 0.4, 0.8, kStorey, 0.0}, 1.5);
  b.panel({kWestWall + 0.5 * kPartition, 11.0, kStorey + 1.2, kEast}, 0.8, 1.0);
  for (const Room& room : rooms()) furnish(b, room);
  return b.build();
}

std::vector<Waypoint> buildingTour() {
  constexpr double kEye = 1.45, kAisle = 6.9;
  std::vector<Waypoint> tour = {{{kAisle, 1.2, kEye}, {kAisle, 6.0, 1.2}}};
  const std::vector<Room> all = rooms();
  // Up the corridor of the ground floor, west and east rooms in turn, a look round in each.
  for (std::size_t i = 0; i < 4; ++i) {
    for (const Room& r : {all[i], all[i + 4]}) {
      const double wall = r.east ? kEastWall : kWestWall, in = r.east ? 1.0 : -1.0, y = r.door_y;
      tour.push_back({{kAisle, y - 0.2, kEye}, {wall + 2.0 * in, y + 0.4, 0.8}});
      tour.push_back({{wall, y, kEye}, {wall + 2.5 * in, y + 0.8, 0.7}});
      const double in_y = std::min(y, r.y_max - 1.2);
      tour.push_back({{wall + 1.3 * in, in_y + 0.4, kEye}, {wall + 4.0 * in, in_y + 4.0, 0.9}});
      tour.push_back({{wall + 1.9 * in, in_y + 0.2, kEye}, {wall + 4.0 * in, in_y - 2.5, 0.9}});
      tour.push_back({{wall + 1.0 * in, y, kEye}, {wall - 0.5 * in, y - 0.8, 1.1}});
      tour.push_back({{kAisle, y + 0.1, kEye}, {kAisle + 0.6, y + 2.5, 0.7}});
    }
  }
  return tour;
}

}  // namespace ttsdf
