#pragma once
// Registration of a scan against a distance field: min over T of sum rho(f(T p_i)) (paper, section III-B).

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "ttsdf_localization/field/distance_field.h"
#include "ttsdf_localization/geometry/se3.h"
#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

enum class TerminationReason : std::uint8_t {
  kConverged,  ///< step and cost below their thresholds
  kMaxIterations,
  kTooFewPoints,  ///< fewer usable points than min_points
  kOutsideMap,    ///< nearly every point outside the map or in unknown space
  kDegenerate,    ///< the system could not be solved
  kAmbiguous,     ///< global: two places look alike
  kLowScore,      ///< search, global: no start explained the scan
  kCancelled,
};

const char* name(TerminationReason reason);  ///< "converged", "max_iterations", ...

struct RegistrationOptions {
  std::string method = "robust";  ///< "robust" (Levenberg-Marquardt) or "gauss_newton" (as in the paper)
  int max_iterations = 60;
  double rotation_epsilon = 1e-4;     ///< stop when a step turns less [rad] ...
  double translation_epsilon = 1e-4;  ///< ... and moves less [m]
  double cost_epsilon = 1e-4;         ///< ... or the cost falls by less than this share
  double kernel_scale_start = 2.0;    ///< Geman-McClure scale of the first iterations [m]
  double kernel_scale_end = 0.05;     ///< and of the last ones [m]
  double kernel_scale_least = 0.004;  ///< narrower, down to this, where residuals are small [m]
  double inlier_distance = 0.05;      ///< |f| below this is an inlier [m]
  double min_inlier_ratio = 0.4;      ///< of the points in known space; fewer is no success
  double min_known_ratio = 0.2;       ///< share of points in known space that is needed
  double weak_threshold = 0.01;       ///< directions with less information are reported as weak
  bool hold_weak = true;              ///< and stay at the prior
  double weak_sigma =
      1.0;  ///< standard deviation reported for them then [m] (rotation: over the scan's radius)
  bool check_facing = true;  ///< points behind a mapped surface, as the scan sees it, carry no information
  bool long_range = true;    ///< pull scans in by a coarse distance field made from the map when it is loaded
  int restarts = 32;  ///< further starts around the prior when the first one explains the scan badly ...
  double restart_score = 0.25;  ///< ... that is, with a score above this; 0 restarts: one start only
  int min_points = 50;
  int max_points = 4500;  ///< more points are sub-sampled evenly
};
const OptionTable<RegistrationOptions>& registrationOptionTable();

struct RegistrationResult {
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  TerminationReason reason = TerminationReason::kTooFewPoints;
  bool success = false;  ///< the estimate may be used (converged and explains the scan)
  int iterations = 0;
  int points = 0;              ///< points used
  double rms_residual = 0.0;   ///< of the inliers [m]
  double inlier_ratio = 0.0;   ///< inliers / points in known space
  double outside_ratio = 0.0;  ///< points outside the box / points
  double unknown_ratio = 0.0;  ///< points in unknown space / points
  double behind_ratio = 0.0;   ///< points that mapped surfaces turn their backs on / points
  double score = 1.0;  ///< mean r^2 / (r^2 + s^2), s = 3 cm; unknown 0.7, outside or behind 1 (0 is perfect)
  double blocked_ratio = 0.0;    ///< rays that the map's matter stands in the way of / rays (method robust)
  double runner_up_score = 1.0;  ///< global: score + blocked_ratio of the best distinct other place
  Eigen::Isometry3d T_map_runner_up = Eigen::Isometry3d::Identity();
  Matrix6d covariance =
      Matrix6d::Zero();  ///< of the left perturbation [rotation; translation] about the sensor's position
  /// Information per direction, rising: mean square change of residual per metre the points move (1: every
  /// point sees it). Rotations are scaled by the scan's radius; columns of the eigenvectors are [rotation *
  /// radius; translation].
  Vector6d hessian_eigenvalues = Vector6d::Zero();
  Matrix6d hessian_eigenvectors = Matrix6d::Identity();
  int weak_directions = 0;  ///< eigenvalues without information, from the smallest
  double milliseconds = 0.0;
};

/// Scan points in the sensor frame [m], 3 x n; non-finite columns are ignored.
using ScanPoints = Eigen::Matrix3Xf;

class Registration {
 public:
  /// Shares the field. `far`: its far field if there is one already; if not and `long_range` asks for it, it
  /// is made (about 1 us per coarse sample). Throws std::invalid_argument for a null field or bad options.
  explicit Registration(std::shared_ptr<const DistanceField> field, RegistrationOptions options = {},
                        std::shared_ptr<const DistanceField> far = nullptr);
  ~Registration();
  Registration(Registration&&) noexcept;
  Registration& operator=(Registration&&) noexcept;

  /// From the prior; the options say how many restarts around it a bad fit is worth. Not thread-safe (owns
  /// work space); never throws for bad points.
  RegistrationResult align(const ScanPoints& points, const Eigen::Isometry3d& T_map_sensor_prior);

  /// Only the last stages, from a pose that is already within a few centimetres: no far field, no restarts,
  /// and no covariance. What multi-start search compares its candidates with.
  RegistrationResult polish(const ScanPoints& points, const Eigen::Isometry3d& T_map_sensor);

  const RegistrationOptions& options() const;
  const DistanceField& field() const;
  /// The coarse far field (null if the map shows no surface, or `long_range` is off and none was given).
  const std::shared_ptr<const DistanceField>& longRangeField() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ttsdf
