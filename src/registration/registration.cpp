#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "near_far_field.h"
#include "registration_impl.h"
#include "result.h"
#include "ttsdf_localization/field/long_range_field.h"
#include "ttsdf_localization/sensor/sensor_model.h"

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

constexpr double kClustersPerRadius = 4.0;  // of the verification
constexpr double kFinePart = 0.5;           // of restart_score: the map alone is enough
constexpr double kSamePlace = 0.3;          // of the scan's radius
constexpr double kSameAngle = 0.3;          // [rad]

}  // namespace

Registration::Impl::Impl(std::shared_ptr<const DistanceField> field, const RegistrationOptions& options,
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
  uses_far_field_ = wanted && long_range_;
  map_ = field_;
  if (long_range_ && options_.method == "robust") field_ = std::make_shared<NearFarField>(map_, long_range_);
}

RegistrationResult Registration::Impl::align(const ScanPoints& points, const Eigen::Isometry3d& T_prior,
                                             const std::optional<Matrix6d>& covariance) {
  const auto begin = Clock::now();
  RegistrationResult result = prepareScan(points, T_prior);
  if (usable(T_prior)) {
    prepare(*field_, scan_, scan_.size(), T_prior);
    if (options_.method == "gauss_newton") {
      solveGaussNewton(T_prior, result);
    } else {
      prior_ = covariance ? PosePrior::fromCovariance(T_prior, *covariance) : defaultPrior(T_prior);
      solveFromPrior(result);
    }
  }
  result.milliseconds = millisecondsSince(begin);
  return result;
}

RegistrationResult Registration::Impl::alignFrom(const ScanPoints& points,
                                                 const std::vector<Eigen::Isometry3d>& starts,
                                                 const PosePrior& prior) {
  const auto begin = Clock::now();
  RegistrationResult result = prepareScan(points, prior.T_map_sensor);
  prior_ = prior;
  if (usable(prior.T_map_sensor) && !starts.empty()) solveFromStarts(starts, result);
  result.milliseconds = millisecondsSince(begin);
  return result;
}

RegistrationResult Registration::Impl::prepareScan(const ScanPoints& points, const Eigen::Isometry3d& T) {
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

bool Registration::Impl::usable(const Eigen::Isometry3d& T) const {
  return scan_.size() >= options_.min_points && T.matrix().allFinite();
}

PosePrior Registration::Impl::defaultPrior(const Eigen::Isometry3d& T) const {
  const double translation = options_.prior_translation_sigma > 0.0
                                 ? options_.prior_translation_sigma
                                 : std::max(0.25 * scan_.range(), scales_.voxel);
  return PosePrior::fromSigmas(T, translation, options_.prior_rotation_sigma);
}

void Registration::Impl::solveGaussNewton(const Eigen::Isometry3d& T_prior, RegistrationResult& result) {
  prior_ = PosePrior{T_prior, Matrix6d::Zero()};
  StageOptions stage = stageOptions(scales_.last, scan_.size(), options_.max_iterations);
  stage.model.robust = false;
  stage.model.limit_gradient = false;
  const StageResult solved = gaussNewton(*field_, scan_, T_prior, stage);
  iterations_ = solved.iterations;
  fillStatistics(solved, result);
  result.success =
      result.reason == TerminationReason::kConverged || result.reason == TerminationReason::kMaxIterations;
  if (result.success && result.inlier_ratio < options_.min_inlier_ratio) {
    result.success = false;
    result.reason = TerminationReason::kLowScore;
  }
  if (result.success) result.covariance = measuredCovariance(solved);
}

void Registration::Impl::solveFromPrior(RegistrationResult& result) {
  const Eigen::Isometry3d& T_prior = prior_.T_map_sensor;
  std::vector<Hypothesis> all{solveHypothesis(T_prior)};
  const bool doubtful = uses_far_field_ && knownSpaceScore(all.front()) > kFinePart * options_.restart_score;
  if (doubtful) descendFromPrior(all);
  const bool may_restart = doubtful && options_.restarts > 0;
  const bool restarted = may_restart && knownSpaceScore(all.front()) > options_.restart_score;
  if (restarted) {
    for (const Hypothesis& other : restart()) addHypothesis(other, kMargin, all);
  }
  const RegistrationResult blank = result;
  refineAndVerify(all.front(), result);
  // In a map with gaps another place may explain more of the scan, and badly: what is known decides.
  const auto firstVerified = [&](auto begin, auto end) {
    sortByCost(begin, end);
    for (; begin != end && !result.success; ++begin) {
      RegistrationResult other = blank;
      refineAndVerify(*begin, other);
      if (other.success) result = other;
    }
  };
  if (!result.success) firstVerified(all.begin() + 1, all.end());
  if (result.success || !may_restart) return;
  std::vector<Hypothesis> more = restartNear(all);
  if (!restarted) {
    for (const Hypothesis& other : restart()) more.push_back(other);
  }
  firstVerified(more.begin(), more.end());
}

void Registration::Impl::solveFromStarts(const std::vector<Eigen::Isometry3d>& starts,
                                         RegistrationResult& result) {
  std::vector<Hypothesis> all;
  for (const auto& T : starts) all.push_back(solveHypothesis(fusedWithPrior(T)));
  sortByCost(all.begin(), all.end());
  refineAndVerify(all.front(), result);
  for (const Hypothesis& other : all) {
    const PoseError e = poseError(result.T_map_sensor, other.stage.T_map_sensor);
    const bool same = e.translation < kSamePlace * scan_.radius() && e.rotation < kSameAngle;
    const double its_score = score(other.stage.equations) + other.blocked;
    if (same || its_score >= result.runner_up_score) continue;
    result.runner_up_score = its_score;
    result.T_map_runner_up = other.stage.T_map_sensor;
  }
}

void Registration::Impl::refineAndVerify(Hypothesis& best, RegistrationResult& result) {
  refine(best.stage);
  const HeldOut held_out(scan_, std::max(scan_.radius() / kClustersPerRadius, scales_.voxel));
  Verification verification = verifyStage(best.stage, held_out);
  if (!verification.better_poses.empty()) {
    // Along a weak direction another pose may explain the scan better.
    evaluateCost(best);
    bool moved = false;
    for (const auto& T : verification.better_poses) {
      Hypothesis other = solveHypothesis(T);
      refine(other.stage);
      evaluateCost(other);
      moved = replaceIfBetter(other, kMargin, best) || moved;
    }
    if (moved) verification = verifyStage(best.stage, held_out);
  }
  restorePrior(verification, best.stage);
  fillStatistics(best.stage, result);
  const PoseError moved = poseError(best.T_blocked, best.stage.T_map_sensor);
  if (moved.translation + scales_.lever * moved.rotation > scales_.voxel) checkRays(best);
  accept(best, verification, result);
}

namespace {

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
const DistanceField& Registration::nearFarField() const { return impl_->nearFarField(); }
const std::shared_ptr<const DistanceField>& Registration::longRangeField() const {
  return impl_->longRangeField();
}

}  // namespace ttsdf
