#include "ttsdf_localization/registration/registration.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "descent.h"
#include "minimizer.h"
#include "ray_check.h"
#include "result.h"
#include "scales.h"
#include "start_poses.h"
#include "ttsdf_localization/field/long_range_field.h"
#include "ttsdf_localization/sensor/sensor_model.h"
#include "uncertainty.h"
#include "verification.h"

namespace ttsdf {

namespace {

using Clock = std::chrono::steady_clock;
double millisecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

/// Whether surfaces have an inside: fields made from occupied cells are positive on both sides, and tell
/// nothing about which one a scan sees.
bool hasInside(const DistanceField& field) {
  constexpr int kAlong = 24;  // samples per axis
  constexpr double kNearVoxels = 3.0, kShare = 0.1;
  const GridGeometry& g = field.geometry();
  Eigen::Matrix3Xf points(3, kAlong * kAlong * kAlong);
  const std::array<int, 3> order = field.walkOrder();
  for (int n = 0; n < points.cols(); ++n) {
    Eigen::Vector3d share;
    share[order[2]] = n % kAlong, share[order[1]] = n / kAlong % kAlong,
    share[order[0]] = n / kAlong / kAlong;
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
    if (options_.kernel_scale_start > 0.0 && options_.kernel_scale_end > options_.kernel_scale_start) {
      throw std::invalid_argument(
          "registration: got kernel_scale_end " + std::to_string(options_.kernel_scale_end) +
          " m, wanted at most kernel_scale_start (" + std::to_string(options_.kernel_scale_start) + " m)");
    }
    if (options_.method == "robust") {
      // What a residual is off by beside the sensor's noise: the map shows half a voxel.
      scan_.setSensor(sensorModel(options_.sensor), 0.5 * field_->geometry().voxel_size);
    }
    facing_ = options_.check_facing && options_.method == "robust" && hasInside(*field_);
    const bool wanted = options_.long_range && options_.method == "robust";
    if (wanted && !long_range_) {
      long_range_ = makeLongRangeField(*field_);
      field_->warmUp();  // whose cache is full of far places now
    }
    pulls_in_ = wanted && long_range_;
  }

  RegistrationResult align(const ScanPoints& points, const Eigen::Isometry3d& T_prior,
                           const std::optional<Matrix6d>& covariance) {
    const auto begin = Clock::now();
    RegistrationResult result = startWith(points, T_prior);
    if (usable(T_prior)) {
      prepare(*field_, scan_, scan_.size(), T_prior);
      if (options_.method == "gauss_newton") {
        solvePlain(T_prior, result);
      } else {
        prior_ = covariance ? PosePrior::fromCovariance(T_prior, *covariance) : defaultPrior(T_prior);
        solveNear(result);
      }
    }
    result.milliseconds = millisecondsSince(begin);
    return result;
  }

  RegistrationResult alignFrom(const ScanPoints& points, const std::vector<Eigen::Isometry3d>& starts,
                               const PosePrior& prior) {
    const auto begin = Clock::now();
    RegistrationResult result = startWith(points, prior.T_map_sensor);
    prior_ = prior;
    if (usable(prior.T_map_sensor) && !starts.empty()) solveFrom(starts, result);
    result.milliseconds = millisecondsSince(begin);
    return result;
  }

  const RegistrationOptions& options() const { return options_; }
  const DistanceField& field() const { return *field_; }
  const std::shared_ptr<const DistanceField>& longRangeField() const { return long_range_; }

 private:
  /// A pose with what speaks for it.
  struct Hypothesis {
    StageResult stage;
    Eigen::Isometry3d T_blocked = Eigen::Isometry3d::Identity();  ///< pose at which `blocked` was seen
    double blocked = 0.0;
    double cost = 0.0;  ///< negative log likelihood of scan and prior, up to a constant
  };

  RegistrationResult startWith(const ScanPoints& points, const Eigen::Isometry3d& T) {
    RegistrationResult result;
    result.T_map_sensor = T;
    scan_.assign(points, options_.max_points);
    const double spacing = long_range_ ? long_range_->geometry().voxel_size : field_->geometry().voxel_size;
    scales_ = Scales(options_, field_->geometry().voxel_size, spacing, scan_);
    result.points = scan_.size();
    result.inlier_distance = scales_.tolerance;
    iterations_ = 0;
    return result;
  }

  bool usable(const Eigen::Isometry3d& T) const {
    return scan_.size() >= options_.min_points && T.matrix().allFinite();
  }

  PosePrior defaultPrior(const Eigen::Isometry3d& T) const {
    const double translation = options_.prior_translation_sigma > 0.0
                                   ? options_.prior_translation_sigma
                                   : std::max(0.25 * scan_.range(), scales_.voxel);
    return PosePrior::fromSigmas(T, translation, options_.prior_rotation_sigma);
  }

  ResidualModel model(double scale) const {
    ResidualModel m;
    m.scale = scale;
    m.inlier_distance = scales_.tolerance;
    m.score_scale = scales_.score;
    m.check_facing = facing_;
    m.deep_inside = 2.5 * scales_.voxel;
    return m;
  }

  StageOptions stageOptions(double scale, int points, int iterations) const {
    StageOptions stage;
    stage.points = points;
    stage.model = model(scale);
    stage.max_iterations = std::max(2, std::min(iterations, options_.max_iterations));
    stage.rotation_epsilon = options_.rotation_epsilon;
    stage.translation_epsilon = options_.translation_epsilon;
    stage.cost_epsilon = options_.cost_epsilon;
    stage.prior = prior_;
    return stage;
  }

  void solvePlain(const Eigen::Isometry3d& T_prior, RegistrationResult& result) {
    prior_ = PosePrior{T_prior, Matrix6d::Zero()};
    StageOptions stage = stageOptions(scales_.last, scan_.size(), options_.max_iterations);
    stage.model.robust = false;
    stage.model.limit_gradient = false;
    const StageResult solved = gaussNewton(*field_, scan_, T_prior, stage);
    iterations_ = solved.iterations;
    describe(solved, result);
    result.success =
        result.reason == TerminationReason::kConverged || result.reason == TerminationReason::kMaxIterations;
    if (result.success && result.inlier_ratio < options_.min_inlier_ratio) {
      result.success = false;
      result.reason = TerminationReason::kLowScore;
    }
    if (result.success) result.covariance = measuredCovariance(solved);
  }

  /// The map itself first, from the prior. Where that does not explain the scan well, the far field and
  /// further starts are other hypotheses, and count if they explain it better.
  void solveNear(RegistrationResult& result) {
    const Eigen::Isometry3d& T_prior = prior_.T_map_sensor;
    Hypothesis best = approach(T_prior);
    if (pulls_in_ && badness(best) > kFinePart * options_.restart_score) {
      coarse_.assign(scan_, kCoarsePoints);
      const Eigen::Isometry3d T_far = heldToPrior(pullIn(T_prior));
      const PoseError apart = poseError(T_far, best.stage.T_map_sensor);
      if (apart.translation > scales_.tolerance || apart.rotation * scales_.lever > scales_.tolerance)
        prefer(approach(T_far), 0.0, best);
      if (options_.restarts > 0 && badness(best) > options_.restart_score) restart(best);
    }
    conclude(best, result);
  }

  void solveFrom(const std::vector<Eigen::Isometry3d>& starts, RegistrationResult& result) {
    std::vector<Hypothesis> all;
    for (const auto& T : starts) all.push_back(approach(heldToPrior(T)));
    std::stable_sort(all.begin(), all.end(),
                     [](const Hypothesis& a, const Hypothesis& b) { return a.cost < b.cost; });
    conclude(all.front(), result);
    for (const Hypothesis& other : all) {
      const PoseError e = poseError(result.T_map_sensor, other.stage.T_map_sensor);
      const bool same = e.translation < kSamePlace * scan_.radius() && e.rotation < kSameAngle;
      const double its_score = score(other.stage.equations) + other.blocked;
      if (same || its_score >= result.runner_up_score) continue;
      result.runner_up_score = its_score;
      result.T_map_runner_up = other.stage.T_map_sensor;
    }
  }

  void conclude(Hypothesis& best, RegistrationResult& result) {
    refine(best.stage);
    const HeldOut held_out(scan_, std::max(scan_.radius() / kClustersPerRadius, scales_.voxel));
    Verification verification = examine(best.stage, held_out);
    if (!verification.better.empty()) {
      // Along a weak direction another pose may explain the scan better.
      weigh(best);
      bool moved = false;
      for (const auto& T : verification.better) {
        Hypothesis other = approach(T);
        refine(other.stage);
        weigh(other);
        moved = prefer(other, kMargin, best) || moved;
      }
      if (moved) verification = examine(best.stage, held_out);
    }
    settleDegenerate(verification, best.stage);
    describe(best.stage, result);
    const PoseError moved = poseError(best.T_blocked, best.stage.T_map_sensor);
    if (moved.translation + scales_.lever * moved.rotation > scales_.voxel) look(best);
    accept(best, verification, result);
  }

  /// What the scan says about a degenerate direction is worth little, or nothing at all.
  Vector6d measuredInformation(const Verification& verification, const StageResult& stage,
                               const InformationAnalysis& info) const {
    Vector6d information = dataWeight(stage.equations, supposedSigma(scales_.last)) * info.share;
    for (std::size_t d = 0; d < 6; ++d) {
      const auto row = static_cast<Eigen::Index>(d);
      if (verification.silent[d]) information[row] = 0.0;
      if (verification.unnoticed[d])
        information[row] = std::min(information[row], 1.0 / (unnoticedSigma() * unnoticedSigma()));
    }
    return information;
  }

  /// Of a direction along which the scan would not notice a pose that is off [m].
  double unnoticedSigma() const { return 0.5 * scales_.probe; }

  /// Along degenerate directions the pose goes back to the prior.
  void settleDegenerate(const Verification& verification, StageResult& stage) const {
    if (verification.degenerate_directions == 0) return;
    const InformationAnalysis info = analyseInformation(stage.equations, scan_.radius());
    stage.T_map_sensor = settle(scan_, stage.T_map_sensor, info.directions,
                                measuredInformation(verification, stage, info), prior_);
    stage.equations = linearize(*field_, scan_, scan_.fitted(), stage.T_map_sensor, model(scales_.last));
  }

  Verification examine(const StageResult& stage, const HeldOut& held_out) const {
    return verify(*field_, scan_, held_out, stage.T_map_sensor, stage.equations, prior_, model(scales_.last),
                  scales_, options_.degenerate_threshold);
  }

  /// Where a fit does not fix the pose it goes back to the prior.
  Eigen::Isometry3d heldToPrior(const Eigen::Isometry3d& T) {
    const NormalEquations e =
        linearize(*field_, scan_, scan_.prefix(kMiddlePoints), T, model(scales_.near_second));
    ++iterations_;
    if (!(e.weight > 0.0)) return T;
    return weighAgainstPrior(e, scan_, T, prior_, supposedSigma(scales_.near_first),
                             gradientNoise(e, scales_.voxel));
  }

  /// The map itself on a part of the points, the kernel as wide as the residuals at the start ask for.
  Hypothesis approach(const Eigen::Isometry3d& T_start) {
    Hypothesis h;
    const int points = scan_.prefix(kMiddlePoints);
    Eigen::Isometry3d T = T_start;
    const double spread = residualSpread(*field_, scan_, points, T, model(scales_.near_second));
    if (kScalePerSigma * spread > 1.5 * scales_.near_second) {
      StageOptions first = stageOptions(scales_.near_first, points, kNearIterations);
      first.cost_epsilon = kMiddleCostEpsilon;
      const StageResult near = levenbergMarquardt(*field_, scan_, T, first);
      iterations_ += near.iterations;
      T = near.T_map_sensor;
    }
    StageOptions second = stageOptions(scales_.near_second, points, kMiddleIterations);
    second.cost_epsilon = kMiddleCostEpsilon;
    h.stage = levenbergMarquardt(*field_, scan_, T, second);
    iterations_ += h.stage.iterations;
    weigh(h);
    return h;
  }

  void look(Hypothesis& h) const {
    h.T_blocked = h.stage.T_map_sensor;
    h.blocked = blockedShare(*field_, long_range_.get(), scan_, h.T_blocked, kRays);
  }

  void weigh(Hypothesis& h) const {
    look(h);
    h.cost = kIndependentPoints * (score(h.stage.equations) + h.blocked) +
             0.5 * prior_.squaredDistance(h.stage.T_map_sensor);
  }

  /// The other one in place of the best, if it is better by more than the margin.
  static bool prefer(const Hypothesis& other, double margin, Hypothesis& best) {
    if (!(other.cost + margin < best.cost)) return false;
    best = other;
    return true;
  }

  /// How badly a pose explains the scan [0, 2]: by the points in known space, because a map with gaps
  /// explains no scan as a whole, and by what the rays went through.
  static double badness(const Hypothesis& h) {
    const NormalEquations& e = h.stage.equations;
    if (e.valid < 0.5 * e.points()) return 2.0;
    return (e.score + e.behind) / std::max(1, e.valid + e.behind) + h.blocked;
  }

  /// The kernel narrowed with the spread of the residuals on a part of the points, the last stage on all but
  /// those held out: outliers, as edges that the map rounds, then count for less.
  void refine(StageResult& best) {
    prepare(*field_, scan_, scan_.size(), best.T_map_sensor);
    const int part = scan_.prefix(kMiddlePoints);
    const double noise = gradientNoise(best.equations, scales_.voxel);
    double scale = scales_.last;
    const auto solve = [&](int points, int iterations, double cost_epsilon,
                           double independent = kIndependentPoints) {
      StageOptions stage = stageOptions(scale, points, iterations);
      stage.gradient_noise = noise;
      stage.independent_points = independent;
      stage.cost_epsilon = std::max(stage.cost_epsilon, cost_epsilon);
      const StageResult solved = levenbergMarquardt(*field_, scan_, best.T_map_sensor, stage);
      iterations_ += solved.iterations;
      if (solved.solvable) best = solved;
      return solved.solvable;
    };
    if (!solve(part, kPartIterations, kMiddleCostEpsilon)) {
      best.solvable = false;
      return;
    }
    for (int pass = 0; pass < kNarrowings; ++pass) {
      const double spread = residualSpread(*field_, scan_, part, best.T_map_sensor, model(scale));
      const double narrower = std::max({kKernelSigmas * spread, scales_.least, kNarrowing * scale});
      if (narrower > 0.8 * scale) break;
      scale = narrower;
      if (!solve(part, kPartIterations, kMiddleCostEpsilon)) break;
    }
    solve(scan_.fitted(), options_.max_iterations, 0.0, kIndependentPointsAtLast);
    // What the scan says about the pose is told with the wide kernel, whatever refined it.
    if (scale < scales_.last)
      best.equations = linearize(*field_, scan_, scan_.fitted(), best.T_map_sensor, model(scales_.last));
  }

  /// A local minimum shows by its score: descend again from poses around the prior and keep what explains the
  /// scan best.
  void restart(Hypothesis& best) {
    const Matrix6d spread = prior_.information.inverse();
    DescentOptions descent;
    descent.rotation_tied_above = scales_.tied_above;
    const double first = std::max(0.5 * scales_.widest, scales_.far_last);
    descent.scales = geometricScales(first, scales_.far_last, kRestartSteps);
    const auto starts = startsAround(prior_.T_map_sensor, spread, options_.restarts + 1, 0);
    const auto found = bestDistinct(descendAll(*long_range_, coarse_, starts, descent), kRestartsRefined,
                                    scales_.tolerance, scales_.tolerance / scales_.lever);
    iterations_ += static_cast<int>(starts.size() * descent.scales.size());
    for (const Candidate& candidate : found)
      prefer(approach(heldToPrior(candidate.T_map_sensor)), kMargin, best);
  }

  /// Descends in the far field. The widest kernel is a few times the residual of the start.
  Eigen::Isometry3d pullIn(const Eigen::Isometry3d& T_start) {
    const NormalEquations start = linearize(*long_range_, coarse_, coarse_.size(), T_start, ResidualModel());
    ++iterations_;
    if (start.valid == 0) return T_start;
    const double widest = std::min(scales_.widest, kScalePerRms * std::sqrt(start.squares / start.valid));
    DescentOptions descent;
    for (double scale = widest; scale > scales_.near_second; scale *= kScaleFactor) {
      descent.scales.insert(descent.scales.end(), kStepsPerScale, scale);
    }
    descent.rotation_tied_above = scales_.tied_above;
    iterations_ += static_cast<int>(descent.scales.size());
    return descend(*long_range_, coarse_, T_start, descent).T_map_sensor;
  }

  /// Statistics and reason.
  void describe(const StageResult& stage, RegistrationResult& result) const {
    report(stage.equations, stage.T_map_sensor, result);
    result.iterations = iterations_;
    const InformationAnalysis info = analyseInformation(stage.equations, scan_.radius());
    result.hessian_eigenvalues = info.share;
    result.hessian_eigenvectors = info.directions;
    result.degenerate_directions =
        static_cast<int>((info.share.array() < options_.degenerate_threshold).count());
    const double known = static_cast<double>(stage.equations.valid) / std::max(1, stage.equations.points());
    if (known < options_.min_known_ratio) {
      result.reason = TerminationReason::kOutsideMap;
    } else if (!stage.solvable) {
      result.reason = TerminationReason::kDegenerate;
    } else {
      result.reason = stage.converged ? TerminationReason::kConverged : TerminationReason::kMaxIterations;
    }
  }

  /// The verification decides whether the pose may be used.
  void accept(const Hypothesis& best, const Verification& verification, RegistrationResult& result) {
    result.blocked_ratio = best.blocked;
    result.degenerate_directions = verification.degenerate_directions;
    result.explained_ratio = verification.explained_ratio;
    result.least_evidence = verification.open_directions > 0
                                ? std::min(verification.weakest, verification.least_evidence)
                                : verification.least_evidence;
    ConfidenceFeatures features{verification.explained_ratio, result.blocked_ratio, result.unmappedRatio(),
                                result.least_evidence};
    result.confidence = confidence(features);
    features.least_evidence = verification.least_evidence;
    result.fit_confidence = confidence(features);
    if (result.reason != TerminationReason::kConverged && result.reason != TerminationReason::kMaxIterations)
      return;
    result.covariance = posteriorCovariance(best.stage, verification);
    if (result.inlier_ratio < options_.min_inlier_ratio) {
      result.reason = TerminationReason::kLowScore;
    } else if (verification.open_directions > 0) {
      result.reason = TerminationReason::kDegenerate;
    } else if (result.confidence < options_.min_confidence) {
      result.reason = TerminationReason::kUnsure;
    } else {
      result.success = true;
    }
  }

  /// Of the scan alone, about the sensor's position.
  Matrix6d measuredCovariance(const StageResult& stage) const {
    const Matrix6d about_centroid =
        sandwichCovariance(*field_, scan_, stage.T_map_sensor, stage.equations, model(scales_.last),
                           std::max(scan_.radius() / kCovarianceClusters, scales_.voxel),
                           options_.degenerate_threshold, kUnmeasured);
    // Twists about the sensor's position: its translation also moves by the rotation times the lever arm.
    Matrix6d shift = Matrix6d::Identity();
    shift.bottomLeftCorner<3, 3>() = hat(stage.T_map_sensor.linear() * scan_.centroid());
    return shift * about_centroid * shift.transpose();
  }
  /// With the prior and the errors of the map, about the sensor's position.
  Matrix6d posteriorCovariance(const StageResult& stage, const Verification& verification) const {
    Matrix6d measured = measuredCovariance(stage);
    const InformationAnalysis info = analyseInformation(stage.equations, scan_.radius());
    Matrix6d shift = Matrix6d::Identity();
    shift.bottomLeftCorner<3, 3>() = hat(stage.T_map_sensor.linear() * scan_.centroid());
    for (std::size_t d = 0; d < 6; ++d) {
      if (!verification.unnoticed[d] && !verification.silent[d]) continue;
      Vector6d along = info.directions.col(static_cast<Eigen::Index>(d));
      along.head<3>() /= std::max(scan_.radius(), 1e-3);
      along = shift * along;
      const double sigma = verification.silent[d] ? kUnmeasured : unnoticedSigma();
      measured += sigma * sigma * along * along.transpose();
    }
    const Matrix6d posterior = (measured.inverse() + prior_.information).inverse();
    FrameAgreement errors = field_->agreement();
    // Frames do not show what the grid does to all of them alike.
    errors.shift = std::hypot(errors.shift, kGridShift * scales_.voxel);
    return withMapErrors(errors, measured, posterior, stage.T_map_sensor.linear() * scan_.centroid());
  }

  static constexpr int kCoarsePoints = 400;  // of the far field's descent
  static constexpr int kStepsPerScale = 6;
  static constexpr double kScalePerRms = 6.0;
  static constexpr double kScaleFactor = 0.55;
  static constexpr int kMiddlePoints = 1000;
  static constexpr int kNearIterations = 5;
  static constexpr int kMiddleIterations = 8;
  static constexpr double kMiddleCostEpsilon = 3e-3;
  static constexpr int kNarrowings = 4;
  static constexpr double kNarrowing = 0.4;  // of the kernel in one pass, at the most
  static constexpr int kPartIterations = 6;
  static constexpr double kKernelSigmas = 5.0;  // kernel scale per spread of the residuals
  static constexpr int kRestartSteps = 10;
  static constexpr std::size_t kRestartsRefined = 3;
  static constexpr int kRays = 100;
  static constexpr double kCovarianceClusters = 4.0;  // per radius of the scan
  static constexpr double kUnmeasured = 1e3;         // [m] standard deviation of what a scan does not measure
  static constexpr double kGridShift = 0.2;          // of a voxel, by which all surfaces are off
  static constexpr double kClustersPerRadius = 4.0;  // of the verification
  static constexpr double kFinePart = 0.5;           // of restart_score: the map alone is enough
  static constexpr double kMargin = 2.0;             // log likelihood that another hypothesis has to gain
  static constexpr double kSamePlace = 0.3;          // of the scan's radius
  static constexpr double kSameAngle = 0.3;          // [rad]

  std::shared_ptr<const DistanceField> field_;
  std::shared_ptr<const DistanceField> long_range_;
  bool pulls_in_ = false;
  bool facing_ = false;
  RegistrationOptions options_;
  ScanBuffer scan_, coarse_;
  Scales scales_;
  PosePrior prior_;
  int iterations_ = 0;
};

namespace {

/// Everything inside works relative to the field's origin.
RegistrationResult inMapFrame(const GridGeometry& geometry, RegistrationResult result) {
  result.T_map_sensor = inMapFrame(geometry, result.T_map_sensor);
  result.T_map_runner_up = inMapFrame(geometry, result.T_map_runner_up);
  return result;
}

}  // namespace

Registration::Registration(std::shared_ptr<const DistanceField> field, RegistrationOptions options,
                           std::shared_ptr<const DistanceField> far)
    : impl_(std::make_unique<Impl>(std::move(field), options, std::move(far))) {}
Registration::~Registration() = default;
Registration::Registration(Registration&&) noexcept = default;
Registration& Registration::operator=(Registration&&) noexcept = default;
RegistrationResult Registration::align(const ScanPoints& points, const Eigen::Isometry3d& T_map_sensor_prior,
                                       const std::optional<Matrix6d>& covariance) {
  const GridGeometry& geometry = impl_->field().geometry();
  return inMapFrame(geometry, impl_->align(points, relativeTo(geometry, T_map_sensor_prior), covariance));
}
RegistrationResult Registration::alignFrom(const ScanPoints& points,
                                           const std::vector<Eigen::Isometry3d>& starts,
                                           const PosePrior& prior) {
  const GridGeometry& geometry = impl_->field().geometry();
  std::vector<Eigen::Isometry3d> relative;
  for (const Eigen::Isometry3d& start : starts) relative.push_back(relativeTo(geometry, start));
  return inMapFrame(
      geometry,
      impl_->alignFrom(points, relative, {relativeTo(geometry, prior.T_map_sensor), prior.information}));
}
const RegistrationOptions& Registration::options() const { return impl_->options(); }
const DistanceField& Registration::field() const { return impl_->field(); }
const std::shared_ptr<const DistanceField>& Registration::longRangeField() const {
  return impl_->longRangeField();
}

}  // namespace ttsdf
