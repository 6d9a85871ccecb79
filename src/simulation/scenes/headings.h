#pragma once
// Directions that things face in the worlds: headings about z.

namespace ttsdf {

constexpr double kPi = 3.14159265358979323846;
constexpr double kEast = 0.0, kNorth = 0.5 * kPi, kWest = kPi, kSouth = -0.5 * kPi;  ///< [rad]

}  // namespace ttsdf
