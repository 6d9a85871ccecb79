#pragma once
// Registration of a scan against a distance field: min over T of sum rho(f(T p_i)) (paper, section III-B).

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ttsdf_localization/field/distance_field.h"
#include "ttsdf_localization/geometry/se3.h"
#include "ttsdf_localization/options/option_table.h"
#include "ttsdf_localization/registration/pose_prior.h"

namespace ttsdf {

enum class TerminationReason : std::uint8_t {
  kConverged,  ///< step and cost below their thresholds
  kMaxIterations,
  kTooFewPoints,  ///< fewer usable points than min_points
  kOutsideMap,    ///< nearly every point outside the map or in unknown space
  kDegenerate,    ///< the system could not be solved
  kAmbiguous,     ///< global: two places look alike
  kLowScore,      ///< no pose found explains the scan
  kUnsure,        ///< the pose found did not stand up to its verification: confidence below min_confidence
  kCancelled,
};

const char* name(TerminationReason reason);  ///< "converged", "max_iterations", ...

/// Lengths of 0 follow from the map's voxel size and the scan.
struct RegistrationOptions {
  std::string method = "robust";  ///< "robust" (Levenberg-Marquardt) or "gauss_newton" (as in the paper)
  /// Of a prior whose covariance nobody gives [m]; 0: a quarter of the scan's range. Not used by
  /// gauss_newton.
  double prior_translation_sigma = 0.0;
  double prior_rotation_sigma = 0.25;  ///< [rad]
  int max_iterations = 60;
  double rotation_epsilon = 1e-4;        ///< stop when a step turns less [rad] ...
  double translation_epsilon = 1e-4;     ///< ... and moves less [m]
  double cost_epsilon = 1e-4;            ///< ... or the cost falls by less than this share
  double kernel_scale_start = 0.0;       ///< Geman-McClure scale of the first iterations [m]
  double kernel_scale_end = 0.0;         ///< of the first stage on all points [m]
  double kernel_scale_least = 0.0;       ///< of the last one where residuals are small, at the least [m]
  double inlier_distance = 0.0;          ///< |f| below this is an inlier [m]
  double min_inlier_ratio = 0.4;         ///< of the points in known space; fewer is no success
  double min_known_ratio = 0.2;          ///< share of points in known space that is needed
  double min_confidence = 0.75;          ///< a verification that is less confident is no success
  double degenerate_threshold = 0.0003;  ///< directions with less information are reported as degenerate
  bool check_facing = true;  ///< points behind a mapped surface, as the scan sees it, carry no information
  bool long_range = true;    ///< pull scans in by a coarse distance field made from the map when it is loaded
  /// Further starts around the prior when the first ones explain the scan badly, and before it is given up;
  /// 0: none.
  int restarts = 32;
  double restart_score = 0.25;  ///< a score above this explains it badly
  std::string sensor =
      "kinect";  ///< how points are weighed over range (sensor/sensor_model.h); method robust
  int min_points = 50;
  int max_points = 4500;  ///< more points are sub-sampled evenly
};
const OptionTable<RegistrationOptions>& registrationOptionTable();

struct RegistrationResult {
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  TerminationReason reason = TerminationReason::kTooFewPoints;
  bool success = false;  ///< the pose was verified: it may be used
  int iterations = 0;
  int points = 0;                ///< points used
  double rms_residual = 0.0;     ///< of the inliers [m]
  double inlier_ratio = 0.0;     ///< inliers / points in known space
  double inlier_distance = 0.0;  ///< what was an inlier [m]
  double outside_ratio = 0.0;    ///< points outside the box / points
  double unknown_ratio = 0.0;    ///< points in unknown space / points
  double behind_ratio = 0.0;     ///< points that mapped surfaces turn their backs on / points
  double score = 1.0;  ///< mean r^2 / (r^2 + s^2), s = 0.6 inlier_distance; unknown 0.7, outside or behind 1
                       ///< (0 is perfect)
  double blocked_ratio = 0.0;    ///< rays that the map's matter stands in the way of / rays (method robust)
  double runner_up_score = 1.0;  ///< global: score + blocked_ratio of the best distinct other place
  Eigen::Isometry3d T_map_runner_up = Eigen::Isometry3d::Identity();
  double explained_ratio = 0.0;  ///< inliers / points in known space, of points that were not used (robust)
  /// Least evidence [standard errors] against a pose that is inlier_distance off along a weak direction
  /// (robust).
  double least_evidence = 0.0;
  double confidence = 0.0;      ///< that the pose is right, from the verification [0, 1] (method robust)
  double fit_confidence = 0.0;  ///< the same of the directions that the scan fixes (others are the prior's)
  /// Of the pose given scan and prior: left perturbation [rotation; translation] about the sensor's position.
  Matrix6d covariance = Matrix6d::Zero();
  /// Information per direction, rising: mean square change of residual per metre the points move (1: every
  /// point sees it). Rotations are scaled by the scan's radius; columns of the eigenvectors are [rotation *
  /// radius; translation].
  Vector6d hessian_eigenvalues = Vector6d::Zero();
  Matrix6d hessian_eigenvectors = Matrix6d::Identity();
  int degenerate_directions = 0;  ///< directions that the scan does not fix; there the pose is the prior's
  double milliseconds = 0.0;

  /// Points that say nothing: outside the map, in unknown space or behind surfaces / points.
  double unmappedRatio() const { return outside_ratio + unknown_ratio + behind_ratio; }
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

  /// The most likely pose given scan and prior. `covariance` is of the prior: left perturbation [rotation;
  /// translation] about the sensor's position; without it the options' sigmas count. Along directions that
  /// the scan does not fix the answer is the prior. Not thread-safe (owns work space); never throws for bad
  /// points.
  RegistrationResult align(const ScanPoints& points, const Eigen::Isometry3d& T_map_sensor_prior,
                           const std::optional<Matrix6d>& covariance = std::nullopt);

  /// The same from several starts: the pose that explains scan and prior best. The runner-up is the best
  /// other place. Of one evidence, the start that comes first.
  RegistrationResult alignFrom(const ScanPoints& points, const std::vector<Eigen::Isometry3d>& starts,
                               const PosePrior& prior);

  const RegistrationOptions& options() const;
  const DistanceField& field() const;
  /// The field as scans ask it: away from its surfaces the far field answers, where there is one.
  const DistanceField& nearFarField() const;
  /// The coarse far field (null if the map shows no surface, or `long_range` is off and none was given).
  const std::shared_ptr<const DistanceField>& longRangeField() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ttsdf
