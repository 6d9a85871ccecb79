#pragma once
// A building of several storeys with rooms on both sides of a corridor, some of them twins: what an atlas of
// many maps is tried on. z is up, the floor of storey n lies at n times kHotelStorey, the corridor runs along
// x about y = 0.

#include <cstdint>
#include <vector>

#include "ttsdf_localization/simulation/analytic_scene.h"
#include "ttsdf_localization/simulation/trajectory.h"

namespace ttsdf {

constexpr double kHotelStorey = 2.98;  ///< from floor to floor [m]

struct HotelOptions {
  int storeys = 3;
  int rooms_per_side = 4;   ///< and storey, on either side of the corridor
  double twin_share = 0.2;  ///< of the rooms: same size, same furniture as another one
  std::uint32_t seed = 1;
};

struct HotelRoom {
  Eigen::AlignedBox3d inside;  ///< from wall to wall, from floor to ceiling [m]
  Eigen::Vector2d door;        ///< middle of its door in the corridor's wall [m]
  int storey = 0;
  bool north = false;  ///< at y > 0
  int design = 0;      ///< rooms of one design and one side are twins
};

struct Hotel {
  AnalyticScene scene;
  std::vector<HotelRoom> rooms;  ///< storey by storey
  std::vector<std::vector<Waypoint>>
      tours;  ///< per storey: along the corridor, into every room and out again
};

/// Equal options, equal hotel. Throws std::invalid_argument for fewer than one storey or room, or a share
/// outside [0, 1].
Hotel makeHotel(const HotelOptions& options = {});

}  // namespace ttsdf
