#pragma once
// How far the frames that a map was made of agree with each other, and what that means for a pose found in
// it.

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

/// Measured while the map is built: frames registered against a volume without them (agreement/).
struct FrameAgreement {
  int compared = 0;         ///< frames that were compared; 0: unknown, as of a map made from a mesh
  int contradicting = 0;    ///< of those overlapping, further off than the comparison reaches, or distorted
  int without_overlap = 0;  ///< frames that saw nothing the others saw
  /// Distance between recorded and registered pose of half and of nine tenths of them.
  double position_median = 0.0, position_90 = 0.0;  ///< [m]
  double rotation_median = 0.0, rotation_90 = 0.0;  ///< [rad]
  /// What a scan's own residuals cannot know, as independent errors of equal size along all axes (standard
  /// deviations): a shift, a turn about the sensor, a turn about the middle of what it sees.
  double shift = 0.0;        ///< [m]
  double turn_sensor = 0.0;  ///< [rad]
  double turn_scene = 0.0;   ///< [rad]

  bool known() const { return compared > 0; }
};

/// Throws std::invalid_argument for negative counts or numbers that are negative or not finite.
void check(const FrameAgreement& agreement);

/// Covariance of these errors as twists [rotation; translation] about the middle of what the sensor sees.
/// `lever`: from the sensor to there, in the axes of the twist [m]. Zero if nothing is known.
Matrix6d mapCovariance(const FrameAgreement& agreement, const Eigen::Vector3d& lever);

}  // namespace ttsdf
