#pragma once
// One stage of the optimisation: fixed kernel scale, fixed number of points.

#include <atomic>

#include "linearizer.h"

namespace ttsdf {

struct StageOptions {
  int points = 0;  ///< prefix of the scan
  ResidualModel model;
  int max_iterations = 20;
  double rotation_epsilon = 1e-4;     ///< [rad]
  double translation_epsilon = 1e-4;  ///< [m]
  double cost_epsilon = 1e-4;         ///< share of the cost
  double weak_threshold = 0.0;        ///< share of the information below which a direction is left alone
};

struct StageResult {
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  NormalEquations equations;  ///< at T_map_sensor
  int iterations = 0;         ///< evaluations of all points of the stage
  bool converged = false;
  bool solvable = true;  ///< false: no information at all
};

/// Gauss-Newton exactly as in the paper: undamped steps until a step falls below both thresholds.
StageResult gaussNewton(const DistanceField& field, const ScanBuffer& scan, const Eigen::Isometry3d& T_start,
                        const StageOptions& options);

/// Levenberg-Marquardt; the cost never rises. Directions with less than `weak_threshold` of the information
/// are not touched (Zhang, Kaess, Singh 2016), so the prior is kept in them.
StageResult levenbergMarquardt(const DistanceField& field, const ScanBuffer& scan,
                               const Eigen::Isometry3d& T_start, const StageOptions& options);

/// Information per direction, dimensionless: eigenvalues (rising) of S H S / weight with S = diag(1/radius,
/// 1), i.e. the mean square change of residual per metre that points move. Columns of `directions` are twists
/// of the scaled space.
struct InformationAnalysis {
  Vector6d share;
  Matrix6d directions;
};
InformationAnalysis analyseInformation(const NormalEquations& equations, double radius);

}  // namespace ttsdf
