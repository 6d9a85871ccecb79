#include "ttsdf_localization/simulation/hotel.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <string>

#include "headings.h"
#include "ttsdf_localization/simulation/scene_builder.h"

namespace ttsdf {

namespace {

constexpr double kHotelSlab = 0.20, kHotelClear = kHotelStorey - kHotelSlab, kHotelPartition = 0.14,
                 kHotelFacade = 0.30;
constexpr double kCorridorHalf = 1.0, kRoomDepth = 4.6;  // of the corridor's width; of a room [m]
constexpr double kHotelDoorWidth = 0.95, kHotelDoorHeight = 2.1,
                 kDoorFrom = 0.9;  // the door's middle, from the room's wall

/// Numbers that are the same with every standard library.
class Dice {
 public:
  explicit Dice(std::uint32_t seed) : engine_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_()) / 4294967296.0;
  }
  int below(int count) { return static_cast<int>(engine_() % static_cast<std::uint32_t>(count)); }

 private:
  std::mt19937 engine_;
};

/// Which design each room has: rooms are given new ones until twins are to come.
std::vector<int> designsOf(const HotelOptions& options) {
  const int count = options.storeys * 2 * options.rooms_per_side;
  Dice dice(options.seed);
  std::vector<int> designs;
  for (int n = 0; n < count; ++n) {
    const bool twin = n > 0 && dice.between(0.0, 1.0) < options.twin_share;
    designs.push_back(twin ? designs[static_cast<std::size_t>(dice.below(n))] : n);
  }
  return designs;
}

double widthOf(int design, std::uint32_t seed) {
  return Dice(seed * 7919U + static_cast<std::uint32_t>(design)).between(3.4, 4.9);
}

/// Furniture of a room, a function of its design alone. `in` points from the corridor into the room.
void furnish(SceneBuilder& b, const HotelRoom& room, std::uint32_t seed) {
  Dice dice(seed * 104729U + static_cast<std::uint32_t>(room.design));
  const double floor = room.inside.min().z(), x0 = room.inside.min().x(), x1 = room.inside.max().x();
  const double in = room.north ? 1.0 : -1.0, wall = in * (kCorridorHalf + 0.5 * kHotelPartition),
               far = wall + in * kRoomDepth;
  const double out_of_wall = room.north ? kSouth : kNorth;
  const double bed = dice.between(1.6, kRoomDepth - 1.2);
  b.bed({x1 - 1.0, wall + in * bed, floor, kWest}, dice.between(0.9, 1.6));
  const double shelf = dice.between(x0 + 0.9, x1 - 1.2);
  b.shelf({shelf, far - in * 0.18, floor, out_of_wall}, {0.4, dice.between(0.8, 1.4), dice.between(1.4, 2.0)},
          2 + dice.below(4), dice.below(5));
  b.cabinet({x0 + 0.2, wall + in * dice.between(1.6, kRoomDepth - 1.0), floor, kEast},
            {0.45, dice.between(0.8, 1.5), dice.between(0.7, 2.0)}, 1 + dice.below(3));
  b.panel(
      {dice.between(x0 + 1.6, x1 - 0.6), wall, floor + dice.between(1.1, 1.4), room.north ? kNorth : kSouth},
      dice.between(0.4, 0.9), dice.between(0.4, 0.7));
  b.panel({x0, wall + in * dice.between(0.8, 1.4), floor + 1.3, kEast}, dice.between(0.4, 0.6), 0.5);
  const double table_x = dice.between(x0 + 1.3, x1 - 2.3), table_y = wall + in * dice.between(2.2, 3.4);
  const double yaw = dice.between(-0.4, 0.4);
  switch (dice.below(4)) {
    case 0:
      b.table({table_x, table_y, floor, yaw}, {0.7, dice.between(0.9, 1.4), 0.74});
      b.chair({table_x - 0.7, table_y, floor, yaw});
      break;
    case 1:
      b.sofa({table_x, table_y, floor, kEast + yaw}, dice.between(1.3, 1.9));
      break;
    case 2:
      b.post({table_x, table_y, floor + 0.70, 0.0}, dice.between(0.4, 0.6), 0.05);
      b.post({table_x, table_y, floor - SceneBuilder::kEmbed, 0.0}, 0.08, 0.78);
      b.plant({x0 + 0.4, far - in * 0.4, floor, 0.0}, dice.between(0.9, 1.6));
      break;
    default:
      b.turnedBox({table_x, table_y, floor + 0.4}, {0.5, 0.4, 0.9}, {0.2, 0.1, yaw});
      b.lamp({x0 + 0.4, far - in * 0.5, floor, 0.0}, dice.between(1.2, 1.7));
  }
}

/// The rooms of one side of a storey, from x = 0 on, with their walls. Returns where the last one ends.
double addSide(SceneBuilder& b, const HotelOptions& options, int storey, bool north, const int* designs,
               std::vector<HotelRoom>& rooms) {
  const double floor = storey * kHotelStorey, top = floor + kHotelClear, in = north ? 1.0 : -1.0;
  const double inner = in * kCorridorHalf, start = -0.5 * kHotelPartition;
  const double outer =
      in * (kCorridorHalf + kHotelPartition + kRoomDepth + 0.5 * (kHotelFacade - kHotelPartition));
  std::vector<WallOpening> doors, windows;
  double x = 0.0;
  for (int n = 0; n < options.rooms_per_side; ++n) {
    HotelRoom room;
    room.storey = storey, room.north = north, room.design = designs[n];
    const double width = widthOf(room.design, options.seed);
    const double near = in * (kCorridorHalf + 0.5 * kHotelPartition), far = near + in * kRoomDepth;
    room.inside = Eigen::AlignedBox3d(Eigen::Vector3d(x, std::min(near, far), floor),
                                      Eigen::Vector3d(x + width, std::max(near, far), top));
    room.door = {x + kDoorFrom, inner};
    const double door = room.door.x() - start, window = x + 0.55 * width - start;
    doors.push_back({door - 0.5 * kHotelDoorWidth, door + 0.5 * kHotelDoorWidth, 0.0, kHotelDoorHeight});
    windows.push_back({window - 0.5, window + 0.5, 0.9, 2.1});
    furnish(b, room, options.seed);
    rooms.push_back(room);
    x += width + kHotelPartition;
    if (n + 1 < options.rooms_per_side) {
      const double between = x - 0.5 * kHotelPartition;
      b.wall({between, inner}, {between, outer}, floor, top, kHotelPartition);
    }
  }
  const double end = x - 0.5 * kHotelPartition;
  b.wall({start, inner}, {end, inner}, floor, top, kHotelPartition, doors);
  b.wall({start, outer}, {end, outer}, floor, top, kHotelFacade, windows);
  return end;
}

/// What makes one part of a corridor look other than the next; flat, the camera passes.
void furnishCorridor(SceneBuilder& b, const std::vector<HotelRoom>& rooms, int storey, double length,
                     std::uint32_t seed) {
  Dice dice(seed * 15485863U + static_cast<std::uint32_t>(storey));
  const double floor = storey * kHotelStorey;
  for (double x = 2.6; x + 1.0 < length; x += dice.between(3.5, 6.0)) {
    const bool north = dice.below(2) == 0;
    const bool at_door = std::any_of(rooms.begin(), rooms.end(), [&](const HotelRoom& room) {
      return room.storey == storey && room.north == north && std::abs(room.door.x() - x) < 1.2;
    });
    if (at_door) continue;
    const double wall = (north ? 1.0 : -1.0) * (kCorridorHalf - 0.5 * kHotelPartition);
    if (dice.below(3) > 0) {
      b.panel({x, wall, floor + dice.between(1.1, 1.5), north ? kSouth : kNorth}, dice.between(0.4, 1.0),
              dice.between(0.4, 0.8));
    } else {
      b.radiator({x, wall, floor, north ? kSouth : kNorth}, dice.between(0.6, 1.2));
    }
  }
}

/// Along the corridor, into every room in turn, a look round in each.
std::vector<Waypoint> tourOf(const std::vector<HotelRoom>& rooms, int storey) {
  std::vector<const HotelRoom*> order;
  for (const HotelRoom& room : rooms) {
    if (room.storey == storey) order.push_back(&room);
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const HotelRoom* a, const HotelRoom* b) { return a->door.x() < b->door.x(); });
  const double floor = storey * kHotelStorey, eye = floor + 1.45;
  std::vector<Waypoint> tour = {{{0.35, 0.0, eye}, {3.0, 0.2, floor + 1.1}}};
  for (const HotelRoom* room : order) {
    const double in = room->north ? 1.0 : -1.0, x = room->door.x(), wall = room->door.y();
    const double end = room->inside.max().x();
    tour.push_back({{x, 0.0, eye}, {x + 0.5, wall, floor + 1.1}});
    tour.push_back({{x, wall, eye}, {x + 0.6, wall + 2.5 * in, floor + 0.8}});
    tour.push_back({{x + 0.1, wall + 1.2 * in, eye}, {end, wall + 3.6 * in, floor + 0.9}});
    tour.push_back({{x + 0.35, wall + 1.35 * in, eye}, {end, wall + 0.6 * in, floor + 0.9}});
    tour.push_back({{x + 0.1, wall + 0.9 * in, eye}, {x - 0.3, wall - 1.0 * in, floor + 1.1}});
    tour.push_back({{x, wall, eye}, {x - 0.1, wall - 2.0 * in, floor + 1.1}});
    tour.push_back({{x, 0.2 * in, eye}, {x + 2.5, 0.1, floor + 1.0}});
  }
  return tour;
}

}  // namespace

Hotel makeHotel(const HotelOptions& options) {
  if (options.storeys < 1 || options.rooms_per_side < 1 ||
      !(options.twin_share >= 0.0 && options.twin_share <= 1.0)) {
    throw std::invalid_argument("hotel: got " + std::to_string(options.storeys) + " storeys of " +
                                std::to_string(options.rooms_per_side) +
                                " rooms a side and a twin share of " + std::to_string(options.twin_share) +
                                ", wanted at least 1, 1 and 0 to 1");
  }
  Hotel hotel;
  SceneBuilder b;
  const std::vector<int> designs = designsOf(options);
  const int* design = designs.data();
  double longest = 0.0;
  for (int storey = 0; storey < options.storeys; ++storey) {
    const double floor = storey * kHotelStorey;
    double length = 0.0;
    for (const bool north : {false, true}) {
      length = std::max(length, addSide(b, options, storey, north, design, hotel.rooms));
      design += options.rooms_per_side;
    }
    // Ends of the corridor, and of rooms that are not as long as the others.
    const double half = kCorridorHalf + kHotelPartition + kRoomDepth + 0.5 * (kHotelFacade - kHotelPartition),
                 x0 = -0.5 * kHotelPartition;
    b.wall({x0, -half}, {x0, half}, floor, floor + kHotelClear, kHotelPartition);
    b.wall({length, -kCorridorHalf}, {length, kCorridorHalf}, floor, floor + kHotelClear, kHotelPartition);
    for (const bool north : {false, true}) {
      double end = 0.0;
      for (const HotelRoom& room : hotel.rooms) {
        if (room.storey == storey && room.north == north) end = room.inside.max().x() + 0.5 * kHotelPartition;
      }
      const double side = north ? 1.0 : -1.0;
      b.wall({end, side * kCorridorHalf}, {end, side * half}, floor, floor + kHotelClear, kHotelPartition);
      if (end + 1e-6 < length)
        b.wall({end, side * kCorridorHalf}, {length, side * kCorridorHalf}, floor, floor + kHotelClear,
               kHotelPartition);
    }
    furnishCorridor(b, hotel.rooms, storey, length, options.seed);
    hotel.tours.push_back(tourOf(hotel.rooms, storey));
    longest = std::max(longest, length);
  }
  const double half = kCorridorHalf + kHotelPartition + kRoomDepth + kHotelFacade;
  for (int slab = 0; slab <= options.storeys; ++slab) {
    const double top = slab * kHotelStorey;
    b.box({-kHotelFacade, -half, top - kHotelSlab}, {longest + kHotelFacade, half, top});
  }
  hotel.scene = b.build();
  return hotel;
}

}  // namespace ttsdf
