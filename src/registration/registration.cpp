#include "ttsdf_localization/registration/registration.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "descent.h"
#include "minimizer.h"
#include "ray_check.h"
#include "result.h"
#include "start_poses.h"
#include "ttsdf_localization/field/long_range_field.h"
#include "uncertainty.h"

namespace ttsdf {

const char* name(TerminationReason reason) {
  switch (reason) {
    case TerminationReason::kConverged:
      return "converged";
    case TerminationReason::kMaxIterations:
      return "max_iterations";
    case TerminationReason::kTooFewPoints:
      return "too_few_points";
    case TerminationReason::kOutsideMap:
      return "outside_map";
    case TerminationReason::kDegenerate:
      return "degenerate";
    case TerminationReason::kAmbiguous:
      return "ambiguous";
    case TerminationReason::kLowScore:
      return "low_score";
    case TerminationReason::kCancelled:
      return "cancelled";
  }
  return "unknown";
}

const OptionTable<RegistrationOptions>& registrationOptionTable() {
  using O = RegistrationOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("method", &O::method, {"robust", "gauss_newton"},
               "Levenberg-Marquardt with a robust kernel, or plain Gauss-Newton as in the paper")
          .add("max_iterations", &O::max_iterations, 1, 1000, "",
               "Evaluations of the scan at the most, but for a narrower kernel")
          .add("rotation_epsilon", &O::rotation_epsilon, 0.0, 0.1, "rad", "A step that turns less ...")
          .add("translation_epsilon", &O::translation_epsilon, 0.0, 0.1, "m",
               "... and moves less ends the iteration")
          .add("cost_epsilon", &O::cost_epsilon, 0.0, 0.1, "",
               "So does a step that lowers the cost by less than this share")
          .add("kernel_scale_start", &O::kernel_scale_start, 0.001, 10.0, "m",
               "Largest Geman-McClure scale; the first iterations start here or at the scan's own residual")
          .add("kernel_scale_end", &O::kernel_scale_end, 0.001, 10.0, "m",
               "Geman-McClure scale of the last iterations")
          .add("kernel_scale_least", &O::kernel_scale_least, 0.0005, 10.0, "m",
               "Scans that fit better than kernel_scale_end supposes are refined with a kernel of six times "
               "the spread of their residuals, at least this; as kernel_scale_end: never")
          .add("inlier_distance", &O::inlier_distance, 0.001, 1.0, "m",
               "A point nearer to the surface is an inlier")
          .add("min_inlier_ratio", &O::min_inlier_ratio, 0.0, 1.0, "",
               "Share of inliers among the points in known space that a successful registration needs")
          .add("min_known_ratio", &O::min_known_ratio, 0.0, 1.0, "",
               "Share of points in known space that a registration needs")
          .add("weak_threshold", &O::weak_threshold, 0.0, 0.5, "",
               "A direction with less of the information is reported as weak")
          .add("hold_weak", &O::hold_weak,
               "Weak directions stay at the prior; off: they follow the little the scan says, for a prior "
               "that counts afterwards")
          .add("weak_sigma", &O::weak_sigma, 0.01, 100.0, "m",
               "Standard deviation reported for directions that stay at the prior")
          .add("check_facing", &O::check_facing,
               "Points behind a mapped surface, as the scan sees it, carry no information; needs scans taken "
               "from the origin of their frame")
          .add("long_range", &O::long_range,
               "Pull scans in by a coarse distance field made when the map is loaded")
          .add("restarts", &O::restarts, 0, 1000, "",
               "Further starts around the prior when the first explains the scan badly")
          .add("restart_score", &O::restart_score, 0.0, 1.0, "", "A score above this explains the scan badly")
          .add("min_points", &O::min_points, 6, 100000, "", "Fewer usable points are refused")
          .add("max_points", &O::max_points, 6, 10000000, "", "More points are sub-sampled evenly");
  return table;
}

namespace {

/// Whether surfaces have an inside: fields made from occupied cells are positive on both sides, and tell
/// nothing about which one a scan sees.
bool hasInside(const DistanceField& field) {
  constexpr int kAlong = 24;  // samples per axis
  constexpr double kNearVoxels = 3.0, kShare = 0.1;
  const GridGeometry& g = field.geometry();
  Eigen::Matrix3Xf points(3, kAlong * kAlong * kAlong);
  for (int n = 0; n < points.cols(); ++n) {
    const Eigen::Vector3d share(n % kAlong, n / kAlong % kAlong, n / kAlong / kAlong);
    points.col(n) = g.samplePosition((share.array() + 0.5) / kAlong * (g.dims.cast<double>().array() - 1.0))
                        .cast<float>();
  }
  const FieldSamples samples = field.evaluate(points);
  const auto reach = static_cast<float>(kNearVoxels * g.voxel_size);
  int near = 0, inside = 0;
  for (int n = 0; n < points.cols(); ++n) {
    if (samples.states[static_cast<std::size_t>(n)] != PointState::kValid ||
        std::abs(samples.values[n]) > reach)
      continue;
    ++near;
    inside += samples.values[n] < 0.0f ? 1 : 0;
  }
  return near > 0 && inside >= kShare * near;
}

}  // namespace

class Registration::Impl {
 public:
  Impl(std::shared_ptr<const DistanceField> field, const RegistrationOptions& options,
       std::shared_ptr<const DistanceField> far)
      : field_(std::move(field)), long_range_(std::move(far)), options_(options) {
    if (!field_) throw std::invalid_argument("registration: got no distance field");
    registrationOptionTable().validate(options_);
    if (options_.kernel_scale_end > options_.kernel_scale_start) {
      throw std::invalid_argument(
          "registration: got kernel_scale_end " + std::to_string(options_.kernel_scale_end) +
          " m, wanted at most kernel_scale_start (" + std::to_string(options_.kernel_scale_start) + " m)");
    }
    facing_ = options_.check_facing && options_.method == "robust" && hasInside(*field_);
    const bool wanted = options_.long_range && options_.method == "robust";
    if (wanted && !long_range_) {
      long_range_ = makeLongRangeField(*field_);
      field_->warmUp();  // whose cache is full of far places now
    }
    pulls_in_ = wanted && long_range_;
  }

  RegistrationResult align(const ScanPoints& points, const Eigen::Isometry3d& T_prior) {
    const auto begin = std::chrono::steady_clock::now();
    RegistrationResult result;
    result.T_map_sensor = T_prior;
    scan_.assign(points, options_.max_points);
    result.points = scan_.size();
    if (scan_.size() >= options_.min_points && T_prior.matrix().allFinite()) {
      if (options_.method == "gauss_newton") {
        solvePlain(T_prior, result);
      } else {
        solveRobust(T_prior, result);
      }
    }
    result.milliseconds =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    return result;
  }

  RegistrationResult polish(const ScanPoints& points, const Eigen::Isometry3d& T_start) {
    const auto begin = std::chrono::steady_clock::now();
    RegistrationResult result;
    result.T_map_sensor = T_start;
    scan_.assign(points, options_.max_points);
    result.points = scan_.size();
    if (scan_.size() >= options_.min_points && T_start.matrix().allFinite()) {
      int iterations = 0;
      const StageResult stage = refine(T_start, iterations);
      judge(stage, iterations, result);
    }
    result.milliseconds =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    return result;
  }

  const RegistrationOptions& options() const { return options_; }
  const DistanceField& field() const { return *field_; }
  const std::shared_ptr<const DistanceField>& longRangeField() const { return long_range_; }

 private:
  ResidualModel model(double scale) const {
    ResidualModel m;
    m.scale = scale;
    m.inlier_distance = options_.inlier_distance;
    m.check_facing = facing_;
    return m;
  }

  void solvePlain(const Eigen::Isometry3d& T_prior, RegistrationResult& result) {
    StageOptions stage = finalStage();
    stage.model.robust = false;
    stage.model.limit_gradient = false;
    const StageResult solved = gaussNewton(*field_, scan_, T_prior, stage);
    finish(solved, solved.iterations, result);
  }

  StageOptions finalStage() const {
    StageOptions stage;
    stage.points = scan_.size();
    stage.model = model(options_.kernel_scale_end);
    stage.max_iterations = options_.max_iterations;
    stage.rotation_epsilon = options_.rotation_epsilon;
    stage.translation_epsilon = options_.translation_epsilon;
    stage.cost_epsilon = options_.cost_epsilon;
    stage.weak_threshold = heldBelow();
    return stage;
  }

  /// Graduated non-convexity. First the far field pulls a part of the points in, from a kernel as wide as the
  /// scan's own residual; then the map itself, first on a part of the points, last on all.
  void solveRobust(const Eigen::Isometry3d& T_prior, RegistrationResult& result) {
    Eigen::Isometry3d T = T_prior;
    int iterations = 0;
    if (pulls_in_) {
      coarse_.assign(scan_, kCoarsePoints);
      iterations += pullIn(T);
    }
    StageResult best = refine(T, iterations);
    if (pulls_in_ && options_.restarts > 0 && verdict(best) > options_.restart_score) {
      restart(T_prior, best, iterations);
    }
    sharpen(best, iterations);
    finish(best, iterations, result);
  }

  /// Scans and maps that are better than kernel_scale_end supposes deserve a narrower kernel: outliers, as
  /// edges that the map rounds, then count for less.
  void sharpen(StageResult& best, int& iterations) {
    double scale = options_.kernel_scale_end;
    for (int pass = 0; pass < kSharpenings && best.solvable; ++pass) {
      const double spread =
          residualSpread(*field_, scan_, scan_.prefix(kMiddlePoints), best.T_map_sensor, model(scale));
      const double narrower = std::max(kKernelSigmas * spread, options_.kernel_scale_least);
      if (narrower > 0.8 * scale) break;
      scale = narrower;
      StageOptions stage = finalStage();
      stage.model = model(scale);
      stage.max_iterations = std::min(kSharpenIterations, options_.max_iterations);
      const StageResult narrow = levenbergMarquardt(*field_, scan_, best.T_map_sensor, stage);
      iterations += narrow.iterations;
      if (!narrow.solvable) break;
      best.T_map_sensor = narrow.T_map_sensor;
    }
    // What the scan says about the pose is told with the wide kernel, whatever refined it.
    if (scale < options_.kernel_scale_end) {
      best.equations =
          linearize(*field_, scan_, scan_.size(), best.T_map_sensor, model(options_.kernel_scale_end));
    }
  }

  /// Share of the information below which a direction is left at the prior.
  double heldBelow() const { return options_.hold_weak ? options_.weak_threshold : 0.0; }

  double blocked(const StageResult& stage) const {
    return blockedShare(*field_, long_range_.get(), scan_, stage.T_map_sensor, kRays);
  }
  /// 0: every point lies on a surface, and every ray got there through free space.
  double verdict(const StageResult& stage) const { return score(stage.equations) + blocked(stage); }

  /// The map itself, from a pose of the far field's accuracy.
  StageResult refine(const Eigen::Isometry3d& T_start, int& iterations) {
    StageOptions stage = finalStage();
    stage.points = scan_.prefix(kMiddlePoints);
    stage.model = model(std::max(kMiddleScale, options_.kernel_scale_end));
    stage.max_iterations = std::min(kMiddleIterations, options_.max_iterations);
    stage.cost_epsilon = kMiddleCostEpsilon;
    const StageResult middle = levenbergMarquardt(*field_, scan_, T_start, stage);
    StageOptions last = finalStage();
    last.max_iterations = std::max(2, options_.max_iterations - middle.iterations);
    StageResult result = levenbergMarquardt(*field_, scan_, middle.T_map_sensor, last);
    iterations += middle.iterations + result.iterations;
    return result;
  }

  /// A local minimum shows by its score: descend again from poses around the prior and keep what explains the
  /// scan best.
  void restart(const Eigen::Isometry3d& T_prior, StageResult& best, int& iterations) {
    Matrix6d spread = Matrix6d::Zero();
    spread.diagonal().head<3>().setConstant(kRestartRotation * kRestartRotation);
    spread.diagonal().tail<3>().setConstant(kRestartTranslation * kRestartTranslation);
    DescentOptions descent;
    descent.rotation_tied_above = kTiedAbove;
    descent.scales = {1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 0.3, 0.3, 0.15, 0.15};
    const auto starts = startsAround(T_prior, spread, options_.restarts + 1, 0);
    const auto found =
        bestDistinct(descendAll(*long_range_, coarse_, starts, descent), kRestartsRefined, 0.05, 0.05);
    iterations += static_cast<int>(starts.size() * descent.scales.size());
    double lowest = verdict(best);
    for (const Candidate& candidate : found) {
      const StageResult other = refine(candidate.T_map_sensor, iterations);
      const double its_verdict = verdict(other);
      if (its_verdict >= lowest) continue;
      lowest = its_verdict;
      best = other;
    }
  }

  /// Descends in the far field; returns the iterations. The widest kernel is a few times the residual of the
  /// start.
  int pullIn(Eigen::Isometry3d& T) {
    const NormalEquations start = linearize(*long_range_, coarse_, coarse_.size(), T, ResidualModel());
    if (start.valid == 0) return 1;
    const double widest =
        std::min(options_.kernel_scale_start, kScalePerRms * std::sqrt(start.squares / start.valid));
    descent_.scales.clear();
    for (double scale = widest; scale > kMiddleScale; scale *= kScaleFactor) {
      descent_.scales.insert(descent_.scales.end(), kStepsPerScale, scale);
    }
    descent_.rotation_tied_above = kTiedAbove;
    T = descend(*long_range_, coarse_, T, descent_).T_map_sensor;
    return 1 + static_cast<int>(descent_.scales.size());
  }

  void finish(const StageResult& stage, int iterations, RegistrationResult& result) {
    judge(stage, iterations, result);
    describeInformation(stage, result);
  }

  /// Statistics, reason and verdict.
  void judge(const StageResult& stage, int iterations, RegistrationResult& result) const {
    report(stage.equations, stage.T_map_sensor, result);
    result.iterations = iterations;
    if (options_.method == "robust") result.blocked_ratio = blocked(stage);
    const double known = static_cast<double>(stage.equations.valid) / std::max(1, stage.equations.points());
    if (known < options_.min_known_ratio) {
      result.reason = TerminationReason::kOutsideMap;
    } else if (!stage.solvable) {
      result.reason = TerminationReason::kDegenerate;
    } else {
      result.reason = stage.converged ? TerminationReason::kConverged : TerminationReason::kMaxIterations;
      result.success = result.inlier_ratio >= options_.min_inlier_ratio;
      if (!result.success) result.reason = TerminationReason::kLowScore;
    }
  }

  void describeInformation(const StageResult& stage, RegistrationResult& result) {
    const InformationAnalysis info = analyseInformation(stage.equations, scan_.radius());
    result.hessian_eigenvalues = info.share;
    result.hessian_eigenvectors = info.directions;
    result.weak_directions = static_cast<int>((info.share.array() < options_.weak_threshold).count());
    if (result.success) {
      const Matrix6d about_centroid =
          sandwichCovariance(*field_, scan_, stage.T_map_sensor, model(options_.kernel_scale_end),
                             kClusterSize, heldBelow(), options_.weak_sigma);
      // Twists about the sensor's position: its translation also moves by the rotation times the lever arm.
      Matrix6d shift = Matrix6d::Identity();
      shift.bottomLeftCorner<3, 3>() = hat(stage.T_map_sensor.linear() * scan_.centroid());
      result.covariance = shift * about_centroid * shift.transpose();
    }
  }

  static constexpr int kCoarsePoints = 400;  // of the far field's descent
  static constexpr int kStepsPerScale = 6;
  static constexpr double kScalePerRms = 6.0;
  static constexpr double kScaleFactor = 0.55;
  static constexpr double kTiedAbove = 0.3;  // [m]
  static constexpr int kMiddlePoints = 1000;
  static constexpr int kMiddleIterations = 8;
  static constexpr double kMiddleScale = 0.1;  // [m] of the map's first stage
  static constexpr double kMiddleCostEpsilon = 3e-3;
  static constexpr int kSharpenings = 2;
  static constexpr int kSharpenIterations = 10;
  static constexpr double kKernelSigmas = 6.0;        // kernel scale per spread of the residuals
  static constexpr double kRestartTranslation = 0.4;  // [m] spread of the restarts
  static constexpr double kRestartRotation = 0.15;    // [rad]
  static constexpr std::size_t kRestartsRefined = 3;
  static constexpr int kRays = 100;
  static constexpr double kClusterSize = 0.3;  // [m]

  std::shared_ptr<const DistanceField> field_;
  std::shared_ptr<const DistanceField> long_range_;
  bool pulls_in_ = false;
  bool facing_ = false;
  RegistrationOptions options_;
  ScanBuffer scan_, coarse_;
  DescentOptions descent_;
};

Registration::Registration(std::shared_ptr<const DistanceField> field, RegistrationOptions options,
                           std::shared_ptr<const DistanceField> far)
    : impl_(std::make_unique<Impl>(std::move(field), options, std::move(far))) {}
Registration::~Registration() = default;
Registration::Registration(Registration&&) noexcept = default;
Registration& Registration::operator=(Registration&&) noexcept = default;
RegistrationResult Registration::align(const ScanPoints& points,
                                       const Eigen::Isometry3d& T_map_sensor_prior) {
  return impl_->align(points, T_map_sensor_prior);
}
RegistrationResult Registration::polish(const ScanPoints& points, const Eigen::Isometry3d& T_map_sensor) {
  return impl_->polish(points, T_map_sensor);
}
const RegistrationOptions& Registration::options() const { return impl_->options(); }
const DistanceField& Registration::field() const { return impl_->field(); }
const std::shared_ptr<const DistanceField>& Registration::longRangeField() const {
  return impl_->longRangeField();
}

}  // namespace ttsdf
