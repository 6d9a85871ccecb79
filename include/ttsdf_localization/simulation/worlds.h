#pragma once
// The worlds that tests and the demo live in. All are deterministic; z is up, the floor is at z = 0, the
// origin is at a corner of the interior (apartment, room) or of the outer walls (building).

#include <string>
#include <vector>

#include "ttsdf_localization/simulation/analytic_scene.h"
#include "ttsdf_localization/simulation/trajectory.h"

namespace ttsdf {

/// One closed room of 4 x 3 x 2.5 m with a table, a cylinder, a ball and a slanted box.
AnalyticScene makeRoom();
/// Living room, kitchen, corridor, bedroom, bath and study, 10 x 8 x 2.6 m inside, furnished; open windows
/// give no reading.
AnalyticScene makeApartment();
/// Two storeys with a corridor, eight rooms each and stairs: 736 x 934 x 309 samples of 2 cm (x, y, z) cover
/// it exactly, 14.70 x 18.66 x 6.16 m.
AnalyticScene makeBuilding();

// Worlds in which some directions cannot be observed; all ends lie beyond a depth camera's range.
AnalyticScene makeCorridor();    ///< along x, 2 m wide, 2.5 m high: x is free
AnalyticScene makeSingleWall();  ///< the plane y = 2: x, z and the turn about y are free
AnalyticScene makeFloor();       ///< the plane z = 0: x, y and the turn about z are free

/// A world with a camera path through it (the body frame, x forward, z up).
struct World {
  std::string name;
  AnalyticScene scene;
  std::vector<Waypoint> tour;
  bool closed = false;  ///< the tour returns to its start
};

/// "apartment", "building", "hotel" (hotel.h, its lowest storey toured), "room", "corridor", "single_wall",
/// "floor". Throws std::invalid_argument for another name.
World makeWorld(const std::string& name);
const std::vector<std::string>& worldNames();

}  // namespace ttsdf
