#pragma once

#include "solver/linearizer.h"
#include "ttsdf_localization/registration/registration.h"

namespace ttsdf {

/// What a point in unknown space adds to the score: a surface may well be there, but nothing speaks for it.
constexpr double kUnknownScore = 0.7;

/// Mean of r^2 / (r^2 + s^2) with s = 0.6 inlier distances, unknown 0.7, outside or behind a surface 1; 0 is
/// perfect.
double score(const NormalEquations& equations);

/// What tells poses of one scan apart, 0 is perfect: every point lies on a surface, and every ray got there
/// through free space.
inline double totalScore(const RegistrationResult& result) { return result.score + result.blocked_ratio; }

/// Pose and statistics of the points into the result.
void report(const NormalEquations& equations, const Eigen::Isometry3d& T_map_sensor,
            RegistrationResult& result);

}  // namespace ttsdf
