#include "ttsdf_localization/localization/localizer.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <utility>

namespace ttsdf {

namespace {
constexpr double kNever = -std::numeric_limits<double>::infinity();
constexpr double kUsualGain = 0.01;
constexpr double kLeap = 2.0;  // standard deviations from the prior beyond which a pose must fit very well
/// No prior is more certain than this [rad, m]: the map's own errors are the same in every scan.
const Matrix6d kLeastCovariance = isotropicCovariance(5e-4, 1e-3);
/// From the sensor's position to the base's, map axes [m].
Eigen::Vector3d baseFromSensor(const LocalizationUpdate& update) {
  return update.T_map_base.translation() - update.T_map_sensor.translation();
}

PoseEstimate atSensor(const LocalizerScan& scan, const Prediction& prior) {
  const Eigen::Isometry3d T_map_sensor = prior.T_map_base * scan.T_base_sensor;
  return {T_map_sensor, movedCovariance(prior.covariance + kLeastCovariance,
                                        T_map_sensor.translation() - prior.T_map_base.translation())};
}
}  // namespace

Localizer::Localizer(LocalizerOptions options)
    : options_(std::move(options)),
      motion_(options_.motion),
      last_stamp_(kNever),
      last_silent_stamp_(kNever),
      confirmed_from_(kNever),
      last_search_stamp_(kNever),
      last_global_stamp_(kNever) {
  validate(options_);
}

PreparedMap Localizer::prepare(std::shared_ptr<const DistanceField> field,
                               const RegistrationOptions& options) {
  if (!field) throw std::invalid_argument("Localizer::prepare: got no field, wanted one");
  PreparedMap map;
  map.registration = std::make_unique<Registration>(field, options);
  RegistrationOptions near = options;
  near.long_range = false;
  near.restarts = 0;
  map.tracker = std::make_unique<Registration>(field, near, map.registration->longRangeField());
  map.field = std::move(field);
  return map;
}

void Localizer::setMap(PreparedMap map) {
  if (!map.field || !map.registration || !map.tracker)
    throw std::invalid_argument("Localizer::setMap: got an empty map");
  field_ = std::move(map.field);
  registration_ = std::move(map.registration);
  tracker_ = std::move(map.tracker);
  globals_done_ = 0;
  forgetUsualFit();
  if (global_running_) {
    global_running_ = false;  // it searches the old map
    if (motion_.hasPose()) {
      becomeLost(0);
    } else {
      state_ = LocalizerState::kWaitingForPose;
    }
  }
  if (state_ == LocalizerState::kNoMap) {
    state_ = guesses_.empty() ? LocalizerState::kWaitingForPose : LocalizerState::kRelocalizing;
  }
}

void Localizer::setOptions(const LocalizerOptions& options) {
  validate(options);
  options_.gates = options.gates;
  options_.motion = options.motion;
  options_.recovery = options.recovery;
  options_.search = options.search;
  options_.global = options.global;
  motion_.setOptions(options_.motion);
}

void Localizer::setGuess(PoseGuess guess) {
  start_guess_ = guess;
  guesses_.assign(1, std::move(guess));
  guess_attempts_ = 0;
  stopConfirming();
  globals_done_ = 0;
  last_search_stamp_ = kNever;
  global_running_ = false;
  if (hasMap()) state_ = LocalizerState::kRelocalizing;
}

void Localizer::reset() {
  global_running_ = false;
  motion_.reset();
  believed_.reset();
  forgetUsualFit();
  guesses_.clear();
  start_guess_.reset();
  stopConfirming();
  guess_attempts_ = refused_in_row_ = searches_done_ = globals_done_ = 0;
  last_stamp_ = last_silent_stamp_ = last_search_stamp_ = last_global_stamp_ = kNever;
  state_ = hasMap() ? LocalizerState::kWaitingForPose : LocalizerState::kNoMap;
}

void Localizer::timeJumpedBack() {
  std::vector<PoseGuess> guesses;
  if (believed_) {
    // After a loop the odometry starts over: its last correction is right up to the drift, which the search
    // covers.
    PoseGuess guess = *believed_;
    guess.source = "last pose before the time jump";
    guess.stamp = std::numeric_limits<double>::quiet_NaN();
    guess.widen = true;
    guesses.push_back(std::move(guess));
  }
  if (start_guess_) {
    PoseGuess guess = *start_guess_;
    guess.stamp = std::numeric_limits<double>::quiet_NaN();
    guess.T_odom_base.reset();
    guess.widen = true;
    guesses.push_back(std::move(guess));
  }
  const std::optional<PoseGuess> start = start_guess_;
  reset();
  start_guess_ = start;
  guesses_ = std::move(guesses);
  if (hasMap() && !guesses_.empty()) state_ = LocalizerState::kRelocalizing;
}

LocalizationUpdate Localizer::process(const LocalizerScan& scan) {
  // Written so that NaN is refused.
  if (!(scan.stamp > last_stamp_)) {
    LocalizationUpdate update = blank(scan);
    update.reason = RefusalReason::kOldStamp;
    update.message = "the scan is not newer than the one before";
    return finish(update);
  }
  last_stamp_ = scan.stamp;
  return handle(scan);
}

LocalizationUpdate Localizer::relocalize(const LocalizerScan& scan, PoseGuess guess) {
  setGuess(std::move(guess));
  if (scan.stamp > last_stamp_) last_stamp_ = scan.stamp;
  return handle(scan);
}

LocalizationUpdate Localizer::handle(const LocalizerScan& scan) {
  if (!hasMap()) {
    LocalizationUpdate update = blank(scan);
    update.reason = RefusalReason::kNoMap;
    update.message = "no map";
    return finish(update);
  }
  if (global_running_) {
    LocalizationUpdate update = blank(scan);
    update.message = "global localization is running";
    return finish(update);
  }
  if (!guesses_.empty()) return tryGuesses(scan);
  switch (state_) {
    case LocalizerState::kLost:
      return recover(scan);
    case LocalizerState::kNoMap:
    case LocalizerState::kWaitingForPose:
      return wait(scan);
    case LocalizerState::kTracking:
    case LocalizerState::kDegraded:
    case LocalizerState::kRelocalizing:
      break;
  }
  return track(scan);
}

LocalizationUpdate Localizer::track(const LocalizerScan& scan) {
  LocalizationUpdate update = blank(scan);
  const std::optional<Prediction> prior = motion_.predict(scan);
  if (!prior) return refuse(scan, {RefusalReason::kNoPrior, "no external prior for this scan"}, update);

  update.registration = alignNear(scan, *prior);
  update.registered = true;
  Refusal refusal = examine(scan, prior->T_map_base, trackingInliers(), update);
  if (!refusal) refusal = checkJump({update.jump_translation, update.jump_rotation}, options_.gates);
  if (!refusal) refusal = checkPlausible(scan, *prior, update.registration);
  if (!refusal) return accept(scan, *prior, update);

  if (!saysNothing(refusal.reason) && searchDue(scan.stamp, options_.recovery.search_period)) {
    const Prediction spread{prior->T_map_base,
                            prior->covariance + isotropicCovariance(options_.search.rotation_sigma,
                                                                    options_.search.translation_sigma)};
    LocalizationUpdate found = searchAround(scan, {spread}, options_.search);
    // Places further away are for those who are lost.
    if (!judgeNearLast(found) && found.registration.score < update.registration.score &&
        !checkPlausible(scan, *prior, found.registration)) {
      found.relocalized = true;
      return accept(scan, *prior, found);
    }
  }
  return refuse(scan, refusal, update);
}

Refusal Localizer::checkPlausible(const LocalizerScan& scan, const Prediction& prior,
                                  const RegistrationResult& result) const {
  const PoseEstimate expected = atSensor(scan, prior);
  const double sigmas = deviation(result.T_map_sensor, expected.T, expected.covariance + result.covariance);
  if (sigmas <= kLeap) return {};
  // What the motion does not explain, the scan has to.
  if (sigmas <= kMaxDeviation) return checkFitAfterSearch(result, options_.gates, recoveryInliers());
  const PoseError jump = poseError(expected.T, result.T_map_sensor);
  char text[128];
  std::snprintf(text, sizeof(text),
                "%.2f m and %.2f rad from the prior: %.1f standard deviations, at most %.0f allowed",
                jump.translation, jump.rotation, sigmas, kMaxDeviation);
  return {RefusalReason::kJump, text};
}

RegistrationResult Localizer::alignNear(const LocalizerScan& scan, const Prediction& prior) {
  // The narrow kernels first: they do not see people in front of the map, which pull the wide ones away.
  const Eigen::Isometry3d T_map_sensor = prior.T_map_base * scan.T_base_sensor;
  RegistrationResult near = tracker_->align(scan.points, T_map_sensor);
  Refusal refusal = checkTermination(near);
  if (!refusal) refusal = checkFit(near, options_.gates, trackingInliers());
  if (!refusal || saysNothing(refusal.reason)) return near;
  RegistrationResult far = registration_->align(scan.points, T_map_sensor);
  far.milliseconds += near.milliseconds;
  far.iterations += near.iterations;
  return far.score < near.score && !checkPlausible(scan, prior, far) ? far : near;
}

Refusal Localizer::examine(const LocalizerScan& scan, const Eigen::Isometry3d& T_map_base_prior,
                           double min_inlier_ratio, LocalizationUpdate& update) const {
  const RegistrationResult& result = update.registration;
  if (Refusal refusal = checkTermination(result)) return refusal;
  const PoseError jump = poseError(T_map_base_prior * scan.T_base_sensor, result.T_map_sensor);
  update.jump_translation = jump.translation;
  update.jump_rotation = jump.rotation;
  return checkFit(result, options_.gates, min_inlier_ratio);
}

LocalizationUpdate Localizer::accept(const LocalizerScan& scan, const Prediction& prior,
                                     LocalizationUpdate& update) {
  const PoseEstimate before = atSensor(scan, prior);
  const RegistrationResult& result = update.registration;
  const PoseEstimate after = fused(before, {result.T_map_sensor, result.covariance});
  fillPose(scan, {after.T, withPriorInWeakDirections(result.covariance, before.covariance, 6)}, update);
  motion_.correct(scan, update.T_map_base, movedCovariance(after.covariance, baseFromSensor(update)));
  refused_in_row_ = 0;
  confirmations_left_ = std::max(0, confirmations_left_ - 1);
  if (confirmations_left_ > 0 || scan.stamp < confirmed_from_) {
    update.message = "confirming the pose found";
    return finish(update);
  }
  confirmed_from_ = kNever;
  return believe(scan, update);
}

LocalizationUpdate Localizer::place(const LocalizerScan& scan, LocalizationUpdate& update, double seconds) {
  const auto& search = options_.search;
  const Matrix6d spread = isotropicCovariance(search.rotation_sigma, search.translation_sigma);
  const RegistrationResult& result = update.registration;
  fillPose(scan, {result.T_map_sensor, withPriorInWeakDirections(result.covariance, spread, 6)}, update);
  update.relocalized = true;
  motion_.place(scan, update.T_map_base, update.covariance);
  guesses_.clear();
  guess_attempts_ = refused_in_row_ = 0;
  confirmations_left_ = options_.recovery.confirmation_scans;
  confirmed_from_ = seconds > 0.0 ? scan.stamp + seconds : kNever;
  if (!confirming()) return believe(scan, update);
  state_ = LocalizerState::kRelocalizing;
  update.message = "confirming the pose found";
  return finish(update);
}

LocalizationUpdate Localizer::believe(const LocalizerScan& scan, LocalizationUpdate& update) {
  state_ = LocalizerState::kTracking;
  searches_done_ = globals_done_ = 0;
  // Rises at once and falls slowly: people in front of the camera do not lower what is usual.
  const double inliers = update.registration.inlier_ratio;
  usual_inliers_ = std::max(inliers, usual_inliers_ + kUsualGain * (inliers - usual_inliers_));
  const double score = update.registration.score;
  usual_score_ = std::min(score, usual_score_ + kUsualGain * (score - usual_score_));
  update.pose_valid = true;
  believed_ =
      PoseGuess{update.T_map_base, update.covariance, scan.stamp, scan.T_odom_base, true, "last pose"};
  if (update.registration.weak_directions > 0) {
    update.message = std::to_string(update.registration.weak_directions) +
                     " directions with little information: the prior counts there";
  }
  return finish(update);
}

LocalizationUpdate Localizer::refuse(const LocalizerScan& scan, const Refusal& refusal,
                                     LocalizationUpdate& update) {
  update.reason = refusal.reason;
  update.message = refusal.message;
  ++refused_in_row_;
  if (confirming()) {
    stopConfirming();
    becomeLost(searches_done_);
    update.message = "the pose found was not confirmed: " + refusal.message;
    return finish(update);
  }
  // A scan that says nothing does not speak against the odometry, and interrupts those that do.
  const auto& recovery = options_.recovery;
  const bool silent = saysNothing(refusal.reason) && scan.T_odom_base;
  if (silent) last_silent_stamp_ = scan.stamp;
  const double since_good = scan.stamp - motion_.lastStamp();
  const double contradicted = std::min(since_good, scan.stamp - last_silent_stamp_);
  const bool lost = refused_in_row_ >= recovery.lost_after_scans &&
                    (since_good >= std::max(recovery.coast_seconds, recovery.lost_after_seconds) ||
                     (!silent && contradicted >= recovery.lost_after_seconds));
  if (lost) {
    becomeLost(0);
  } else {
    state_ = LocalizerState::kDegraded;
  }
  return finish(update);
}

bool Localizer::confirming() const { return confirmations_left_ > 0 || confirmed_from_ != kNever; }

void Localizer::stopConfirming() {
  confirmations_left_ = 0;
  confirmed_from_ = kNever;
}

void Localizer::forgetUsualFit() {
  usual_inliers_ = 0.0;
  usual_score_ = 1.0;
}

void Localizer::becomeLost(int searches_done) {
  state_ = LocalizerState::kLost;
  searches_done_ = searches_done;
  refused_in_row_ = 0;
  motion_.stop();
}

double Localizer::trackingInliers() const {
  // A pose still to be confirmed is held to the standard it was found by.
  if (confirming()) return recoveryInliers();
  return std::max(options_.gates.min_inlier_ratio, options_.gates.min_relative_inliers * usual_inliers_);
}

double Localizer::recoveryInliers() const {
  return std::max(options_.gates.recovery_inlier_ratio,
                  options_.gates.recovery_relative_inliers * usual_inliers_);
}

GlobalJob Localizer::beginGlobal(const LocalizerScan& scan, const std::optional<Eigen::Vector3d>& gravity) {
  if (!hasMap()) throw std::logic_error("global localization: no map");
  if (state_ == LocalizerState::kTracking || state_ == LocalizerState::kDegraded) searches_done_ = 0;
  guesses_.clear();
  stopConfirming();
  ++globals_done_;
  global_running_ = true;
  state_ = LocalizerState::kRelocalizing;
  return GlobalJob(++global_id_, field_, registration_->longRangeField(), scan, gravity, options_);
}

LocalizationUpdate Localizer::finishGlobal(const GlobalJob& job) {
  LocalizationUpdate update = blank(job.scan());
  if (!global_running_ || job.id() != global_id_) {
    update.reason = RefusalReason::kCancelled;
    update.message = "global localization: overtaken by another pose, map or reset";
    return finish(update);
  }
  global_running_ = false;
  last_global_stamp_ = last_stamp_;
  update.registration = job.result();
  update.registered = true;
  Refusal refusal = checkTermination(job.result());
  if (!refusal)
    refusal = checkFitAfterSearch(job.result(), options_.gates, options_.gates.recovery_inlier_ratio);
  if (!refusal) {
    PoseGuess guess{job.T_map_base(),
                    isotropicCovariance(0.02, 0.05),
                    job.scan().stamp,
                    job.scan().T_odom_base,
                    false,
                    "global localization",
                    options_.recovery.confirmation_seconds};
    guesses_.assign(1, std::move(guess));
    guess_attempts_ = 0;
    update.T_map_base = job.T_map_base();
    update.T_map_sensor = job.result().T_map_sensor;
    update.message = "global localization found a place, confirming it";
    state_ = LocalizerState::kRelocalizing;
    return finish(update);
  }
  update.reason = refusal.reason;
  update.message = "global localization: " + refusal.message;
  if (refusal.reason == RefusalReason::kCancelled) globals_done_ = options_.recovery.global_attempts;
  if (motion_.hasPose()) {
    becomeLost(searches_done_);
  } else {
    state_ = LocalizerState::kWaitingForPose;
  }
  return finish(update);
}

std::optional<PoseGuess> Localizer::lastPose() const { return believed_; }

LocalizationUpdate Localizer::blank(const LocalizerScan& scan) const {
  LocalizationUpdate update;
  update.stamp = scan.stamp;
  return update;
}

void Localizer::fillPose(const LocalizerScan& scan, const PoseEstimate& sensor, LocalizationUpdate& update) {
  update.T_map_sensor = sensor.T;
  update.T_map_base = sensor.T * scan.T_base_sensor.inverse();
  const Matrix6d at_base = movedCovariance(sensor.covariance, baseFromSensor(update));
  update.covariance = 0.5 * (at_base + at_base.transpose());
}

LocalizationUpdate Localizer::finish(LocalizationUpdate& update) const {
  update.state = state_;
  update.twist = motion_.twist();
  if (state_ == LocalizerState::kTracking || state_ == LocalizerState::kDegraded)
    update.T_map_odom = motion_.correction();
  return update;
}

}  // namespace ttsdf
