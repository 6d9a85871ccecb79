#pragma once
// How far the frames that a map was made of agree with each other, and what that means for a pose found in
// it.

#include <vector>

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

/// From where a scan was taken, in the map frame.
struct Viewpoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of the sensor [m]
  /// Mean of the unit vectors from the sensor to its points: two of them differ by the angle between two
  /// views [rad] if that is small, and a sensor that sees all around has next to none.
  Eigen::Vector3d view = Eigen::Vector3d::Zero();
};

/// Viewpoint of points in the sensor frame; columns that are not finite or zero do not count.
Viewpoint viewpointOf(const Eigen::Matrix3Xf& points, const Eigen::Isometry3d& T_map_sensor);

/// Frames that were taken from nearly one viewpoint: their poses tend to be off alike.
struct ViewpointAgreement {
  Viewpoint viewpoint;
  int frames = 1;      ///< compared there, at least 1
  double ratio = 1.0;  ///< their mean squared difference, over what the whole map's sizes let expect
};

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
  /// Where frames agree better or worse than that; may be empty.
  std::vector<ViewpointAgreement> viewpoints;
  double viewpoint_distance = 0.0;  ///< beyond which viewpoints have little in common [m]

  bool known() const { return compared > 0; }
};

/// Views that differ by more than this have little in common [rad].
constexpr double kViewpointAngle = 0.2;

/// How many times the map's variances hold at a viewpoint: the mean ratio of the frames around it, near ones
/// counting most, and of one frame that agrees as the whole map does. 1 without viewpoints.
double varianceRatio(const FrameAgreement& agreement, const Viewpoint& viewpoint);

/// Throws std::invalid_argument for negative counts, a widening below 1, numbers that are negative or not
/// finite, and viewpoints without frames, with a ratio that is not positive, or without a distance.
void check(const FrameAgreement& agreement);

/// Adds to the covariance of a pose what the map's errors do to it: twists [rotation; translation] about the
/// sensor's position. `scan`: what the scan alone tells (positive definite); `posterior`: of the pose, which
/// a prior may have made surer than that; the errors of the scan's surfaces count by the scan's share in it.
/// `lever`: from the sensor to the middle of what it sees, in the axes of the twist [m]. `variance_ratio`: of
/// the scan's viewpoint.
Matrix6d withMapErrors(const FrameAgreement& agreement, const Matrix6d& scan, const Matrix6d& posterior,
                       const Eigen::Vector3d& lever, double variance_ratio = 1.0);

}  // namespace ttsdf
