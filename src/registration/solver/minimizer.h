#pragma once
// One stage of the optimisation: fixed kernel scale, fixed number of points.

#include "linearizer.h"
#include "ttsdf_localization/registration/pose_prior.h"

namespace ttsdf {

/// Errors of a scan's points are correlated (a wall, a patch of the map), so against the prior a scan counts
/// as so many points at most.
constexpr double kIndependentPoints = 100.0;
/// In the last stage residuals are little more than the sensor's noise, which is new in every pixel. With
/// fewer, an odometry that drifts by 5 % pulls the poses after it.
constexpr double kIndependentPointsAtLast = 1000.0;
/// Standard deviation of the residuals that a Geman-McClure kernel of this scale is right for [m].
constexpr double kScalePerSigma = 3.0;
inline double kernelSigma(double kernel_scale) { return kernel_scale / kScalePerSigma; }

struct StageOptions {
  int points = 0;  ///< prefix of the scan
  ResidualModel model;
  int max_iterations = 20;
  double rotation_epsilon = 1e-4;     ///< [rad]
  double translation_epsilon = 1e-4;  ///< [m]
  double cost_epsilon = 1e-4;         ///< share of the cost
  /// What was known before counts as a term of the cost (not in gaussNewton, which is the paper's).
  PosePrior prior;
  /// Share of the information that a direction shows by the noise of the map's gradients alone: it does not
  /// count against the prior.
  double gradient_noise = 0.0;
  double independent_points = kIndependentPoints;  ///< as so many points, at most, the scan counts against it
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

/// Levenberg-Marquardt on scan and prior; the cost never rises.
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

/// What of a direction's information counts, given the noise of the map's gradients: 0 at that noise and
/// below, towards 1 far above.
double countedShare(double share, double gradient_noise);

/// The most likely pose between a fit, known along `directions` (twists of the scaled space) with
/// `information` [1 / m^2], and the prior.
Eigen::Isometry3d fuseWithPrior(const ScanBuffer& scan, const Eigen::Isometry3d& T_fit,
                                const Matrix6d& directions, const Vector6d& information,
                                const PosePrior& prior);

/// What a scan's residuals say about every direction, per unit of its share of the information [1 / m^2].
double dataWeight(const NormalEquations& equations, double sigma);

/// The pose between a fit, of which `equations` are the normal equations, and the prior: along directions
/// that the scan does not fix it is the prior's, whatever found the fit. `sigma`: of an independent residual
/// [m].
Eigen::Isometry3d fuseWithPrior(const NormalEquations& equations, const ScanBuffer& scan,
                                const Eigen::Isometry3d& T_fit, const PosePrior& prior, double sigma,
                                double gradient_noise);

}  // namespace ttsdf
