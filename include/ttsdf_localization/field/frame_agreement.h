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
  /// What a scan's own residuals do not show. The surfaces of such a map are off in ways that the pose takes
  /// up: the standard deviations that a scan tells are this much too small.
  double widening = 1.0;
  /// Beside that, errors of equal size along all axes (standard deviations): a shift, a turn about the
  /// sensor, a turn about the middle of what it sees.
  double shift = 0.0;        ///< [m]
  double turn_sensor = 0.0;  ///< [rad]
  double turn_scene = 0.0;   ///< [rad]

  bool known() const { return compared > 0; }
};

/// Throws std::invalid_argument for negative counts, a widening below 1, or numbers that are negative or not
/// finite.
void check(const FrameAgreement& agreement);

/// Adds to the covariance of a pose what the map's errors do to it: twists [rotation; translation] about the
/// sensor's position. `scan`: what the scan alone tells (positive definite); `posterior`: of the pose, which
/// a prior may have made surer than that; the errors of the scan's surfaces count by the scan's share in it.
/// `lever`: from the sensor to the middle of what it sees, in the axes of the twist [m].
Matrix6d withMapErrors(const FrameAgreement& agreement, const Matrix6d& scan, const Matrix6d& posterior,
                       const Eigen::Vector3d& lever);

}  // namespace ttsdf
