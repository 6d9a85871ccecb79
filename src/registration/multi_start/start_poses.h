#pragma once
// Where multi-start search starts from: low-discrepancy sequences, so that few starts cover evenly and a seed
// repeats.

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "ttsdf_localization/field/distance_field.h"
#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

/// The prior itself, then normally distributed poses around it. `covariance` is of the left perturbation
/// about the sensor's position, [rotation; translation].
std::vector<Eigen::Isometry3d> startsAround(const Eigen::Isometry3d& T_map_sensor, const Matrix6d& covariance,
                                            int count, int seed);

struct GravityHint {
  Eigen::Vector3d down_sensor;  ///< unit vector
  Eigen::Vector3d down_map;     ///< unit vector
  double tilt_sigma;            ///< [rad]
};

/// Space that the map has seen to be free, as of startsOverMap [m^3].
double freeVolume(const DistanceField& field, const DistanceField& far, double clearance, int seed);

/// Sensor positions evenly over the space that the map has seen to be free (`far`, its far field, at least
/// `clearance` [m]; inside the box of the map where it has seen next to nothing) and orientations evenly over
/// all, or over the yaw angles with a tilt of the hint's spread.
std::vector<Eigen::Isometry3d> startsOverMap(const DistanceField& field, const DistanceField& far,
                                             const std::optional<GravityHint>& gravity, double clearance,
                                             int count, int seed);

}  // namespace ttsdf
