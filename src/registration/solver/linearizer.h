#pragma once
// From a pose to the 6x6 normal equations of the robust least squares (paper, section III-B, evaluated at T p
// for both gradient and Hessian). The field is asked in chunks; sums are taken in a fixed order, so results
// are deterministic.

#include <Eigen/Geometry>

#include "../scan_buffer.h"
#include "ttsdf_localization/field/distance_field.h"
#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

struct ResidualModel {
  bool robust = true;             ///< Geman-McClure; false: plain least squares (the paper)
  double scale = 0.1;             ///< Geman-McClure scale [m]
  double inlier_distance = 0.05;  ///< [m]
  double score_scale = 0.03;      ///< of the score [m]
  bool limit_gradient = true;     ///< to unit length: |grad SDF| = 1 by definition, longer ones are artefacts
  /// Points next to a surface that turns its back on the sensor say nothing: the scan sees something else
  /// there, as the other face of a thin wall that was mapped from one side only. Signed fields only.
  bool check_facing = false;
  double deep_inside = 0.05;  ///< deeper in matter a point counts only if the gradient pulls it out [m]
};

/// Cosine between ray and gradient above which a surface is seen from behind.
constexpr double kBehindCosine = 0.3;
/// `value` of a point [m], cosine between its ray and its gradient. Deep inside matter a point counts only if
/// the gradient pulls it out towards the sensor.
inline bool seenFromBehind(double value, double cosine, const ResidualModel& model) {
  return cosine > (value < -model.deep_inside ? -kBehindCosine : kBehindCosine);
}

/// Twist [rotation; translation] about the scan's centroid in the map frame.
struct NormalEquations {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();  ///< gradient of the cost: the step solves H xi = -g
  double cost = 0.0;              ///< sum of the weighted loss of valid points, in [0, weight] each if robust
  double score = 0.0;             ///< sum of r^2 / (r^2 + score_scale^2) of valid points
  double inlier_squares = 0.0;    ///< sum of r^2 of inliers
  double squares = 0.0;           ///< sum of r^2 of valid points
  double weight = 0.0;            ///< sum of the weights of valid points: by kernel times by range
  int valid = 0, unknown = 0, outside = 0, inliers = 0;
  int behind = 0;  ///< seen from behind, if that is checked
  int points() const { return valid + unknown + outside + behind; }
};

/// The first `count` points of the scan at pose T_map_sensor.
NormalEquations linearize(const DistanceField& field, const ScanBuffer& scan, int count,
                          const Eigen::Isometry3d& T_map_sensor, const ResidualModel& model);

/// Spread of the residuals of the points that say something, not led by outliers: 1.4826 times the median of
/// their sizes, sigma if they are normally distributed [m]; 0 without such points.
double residualSpread(const DistanceField& field, const ScanBuffer& scan, int count,
                      const Eigen::Isometry3d& T_map_sensor, const ResidualModel& model);

/// Tells the field that the first `count` points at about this pose are asked for next.
void prepare(const DistanceField& field, const ScanBuffer& scan, int count,
             const Eigen::Isometry3d& T_map_sensor);

/// Left perturbation about the scan's centroid: p -> c + Exp(xi) (p - c) in the map frame.
Eigen::Isometry3d retract(const Eigen::Isometry3d& T_map_sensor, const Eigen::Vector3d& centroid_sensor,
                          const Vector6d& xi);

}  // namespace ttsdf
