#pragma once
// Coordinates of surveys (UTM, ECEF, millions of metres) do not fit single precision. Whatever computes with
// floats does so relative to an origin near the data, whose own coordinates are doubles.

#include <Eigen/Core>

namespace ttsdf {

/// Up to this far from zero single precision is exact to a tenth of a millimetre, and no other origin is
/// needed [m].
constexpr double kNearZero = 1000.0;

/// Zero for a box that is near zero, else its centre in whole metres.
inline Eigen::Vector3d localOrigin(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  if (low.cwiseAbs().maxCoeff() <= kNearZero && high.cwiseAbs().maxCoeff() <= kNearZero)
    return Eigen::Vector3d::Zero();
  return (0.5 * (low + high)).array().round();
}

}  // namespace ttsdf
