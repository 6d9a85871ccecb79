#include "ttsdf_localization/simulation/worlds.h"

#include <stdexcept>
#include <utility>

#include "tours.h"
#include "ttsdf_localization/simulation/hotel.h"
#include "ttsdf_localization/simulation/scene_builder.h"

namespace ttsdf {

namespace {

constexpr double kFar = 50.0;  ///< beyond every camera's range [m]

std::vector<Waypoint> roomTour() {
  return {{{0.7, 0.7, 1.3}, {3.5, 2.2, 0.8}},
          {{2.0, 0.6, 1.4}, {3.6, 2.6, 0.7}},
          {{3.2, 0.9, 1.3}, {0.5, 2.5, 0.8}},
          {{2.6, 1.6, 1.5}, {0.2, 0.6, 0.9}},
          {{1.4, 2.3, 1.4}, {3.8, 0.6, 0.9}}};
}

}  // namespace

AnalyticScene makeRoom() {
  constexpr double kX = 4.0, kY = 3.0, kZ = 2.5, kWall = 0.2, kHalf = 0.5 * kWall;
  SceneBuilder b;
  b.box({-kWall, -kWall, -kWall}, {kX + kWall, kY + kWall, 0.0});
  b.box({-kWall, -kWall, kZ}, {kX + kWall, kY + kWall, kZ + kWall});
  b.wall({-kHalf, -kHalf}, {kX + kHalf, -kHalf}, 0.0, kZ, kWall);
  b.wall({-kHalf, kY + kHalf}, {kX + kHalf, kY + kHalf}, 0.0, kZ, kWall);
  b.wall({-kHalf, -kHalf}, {-kHalf, kY + kHalf}, 0.0, kZ, kWall);
  b.wall({kX + kHalf, -kHalf}, {kX + kHalf, kY + kHalf}, 0.0, kZ, kWall);
  b.table({2.3, 1.9, 0.0, 0.3}, {0.7, 1.1, 0.72});
  b.post({3.6, 2.6, -SceneBuilder::kEmbed, 0.0}, 0.22, 1.25);
  b.sphere({2.2, 1.9, 0.86}, 0.15);
  b.turnedBox({0.5, 2.5, 0.35}, {0.5, 0.4, 0.8}, {0.25, 0.15, 0.6});
  b.panel({0.0, 1.2, 1.1, 0.0}, 0.8, 0.6);
  b.cabinet({3.75, 0.5, 0.0, 3.14159265358979}, {0.52, 0.8, 0.9}, 2);
  return b.build();
}

AnalyticScene makeCorridor() {
  SceneBuilder b;
  b.box({-kFar, -1.3, -0.2}, {kFar, 1.3, 0.0});
  b.box({-kFar, -1.3, 2.5}, {kFar, 1.3, 2.7});
  b.wall({-kFar, -1.1}, {kFar, -1.1}, 0.0, 2.5, 0.2);
  b.wall({-kFar, 1.1}, {kFar, 1.1}, 0.0, 2.5, 0.2);
  return b.build();
}

AnalyticScene makeSingleWall() {
  SceneBuilder b;
  b.box({-kFar, 2.0, -kFar}, {kFar, 2.5, kFar});
  return b.build();
}

AnalyticScene makeFloor() {
  SceneBuilder b;
  b.box({-kFar, -kFar, -0.5}, {kFar, kFar, 0.0});
  return b.build();
}

World makeWorld(const std::string& name) {
  if (name == "apartment") return {name, makeApartment(), apartmentTour(), true};
  if (name == "building") return {name, makeBuilding(), buildingTour(), false};
  if (name == "hotel") {
    Hotel hotel = makeHotel();
    return {name, std::move(hotel.scene), std::move(hotel.tours.front()), false};
  }
  if (name == "room") return {name, makeRoom(), roomTour(), true};
  if (name == "corridor") {
    return {name,
            makeCorridor(),
            {{{-4.0, 0.0, 1.3}, {0.0, 0.3, 1.1}}, {{4.0, 0.2, 1.3}, {8.0, -0.3, 1.1}}},
            false};
  }
  if (name == "single_wall") {
    return {name,
            makeSingleWall(),
            {{{-2.0, 0.0, 0.0}, {-1.0, 2.0, 0.1}}, {{2.0, 0.3, 0.2}, {2.5, 2.0, 0.0}}},
            false};
  }
  if (name == "floor") {
    return {
        name, makeFloor(), {{{-2.0, 0.0, 1.2}, {0.0, 0.5, 0.0}}, {{2.0, 0.5, 1.4}, {3.5, 0.0, 0.0}}}, false};
  }
  std::string known;
  for (const auto& other : worldNames()) known += " " + other;
  throw std::invalid_argument("world: got '" + name + "', wanted one of" + known);
}

const std::vector<std::string>& worldNames() {
  static const std::vector<std::string> kNames = {"apartment", "building",    "hotel", "room",
                                                  "corridor",  "single_wall", "floor"};
  return kNames;
}

}  // namespace ttsdf
