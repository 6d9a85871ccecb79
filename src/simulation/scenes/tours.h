#pragma once
// The camera paths that belong to the worlds; each world's file owns its own.

#include <vector>

#include "ttsdf_localization/simulation/trajectory.h"

namespace ttsdf {

std::vector<Waypoint> apartmentTour();
std::vector<Waypoint> buildingTour();

}  // namespace ttsdf
