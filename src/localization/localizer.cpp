#include "ttsdf_localization/localization/localizer.h"

#include <limits>
#include <stdexcept>
#include <utility>

#include "ttsdf_localization/field/long_range_field.h"

namespace ttsdf {

Localizer::Localizer(LocalizerOptions options)
    : options_(std::move(options)),
      motion_(options_.motion),
      last_stamp_(kNeverStamp),
      last_uninformative_stamp_(kNeverStamp),
      confirmed_from_(kNeverStamp),
      last_search_stamp_(kNeverStamp),
      last_global_stamp_(kNeverStamp) {
  validate(options_);
}

PreparedMap Localizer::prepare(std::shared_ptr<const DistanceField> field, const RegistrationOptions& options,
                               const KeepGoing& keep_going) {
  if (!field) throw std::invalid_argument("Localizer::prepare: got no field, wanted one");
  std::shared_ptr<const DistanceField> far;
  if (options.long_range && options.method == "robust") far = makeLongRangeField(*field, {}, keep_going);
  field->warmUp(keep_going);
  return prepareWith(std::move(field), std::move(far), options);
}

PreparedMap Localizer::prepareWith(std::shared_ptr<const DistanceField> field,
                                   std::shared_ptr<const DistanceField> far,
                                   const RegistrationOptions& options) {
  if (!field) throw std::invalid_argument("Localizer::prepareWith: got no field, wanted one");
  PreparedMap map;
  map.registration = std::make_unique<Registration>(field, options, std::move(far));
  RegistrationOptions near = options;
  near.long_range = false;
  near.restarts = 0;
  map.tracker = std::make_unique<Registration>(field, near, map.registration->longRangeField());
  map.field = std::move(field);
  return map;
}

void Localizer::exchangeMap(PreparedMap map) {
  if (!hasMap()) {
    setMap(std::move(map));
    return;
  }
  if (!map.field || !map.registration || !map.tracker)
    throw std::invalid_argument("Localizer::exchangeMap: got an empty map");
  field_ = std::move(map.field);
  registration_ = std::move(map.registration);
  tracker_ = std::move(map.tracker);
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
  forgetUsualFit();  // what is usual may be another thing there
  guesses_.assign(1, std::move(guess));
  guess_attempts_ = 0;
  stopConfirming();
  globals_done_ = 0;
  last_search_stamp_ = kNeverStamp;
  global_running_ = false;
  if (hasMap()) state_ = LocalizerState::kRelocalizing;
}

void Localizer::reset() {
  global_running_ = false;
  motion_.reset();
  last_valid_.reset();
  forgetUsualFit();
  guesses_.clear();
  start_guess_.reset();
  stopConfirming();
  guess_attempts_ = rejected_in_row_ = searches_done_ = globals_done_ = 0;
  last_stamp_ = last_uninformative_stamp_ = last_search_stamp_ = last_global_stamp_ = kNeverStamp;
  state_ = hasMap() ? LocalizerState::kWaitingForPose : LocalizerState::kNoMap;
}

void Localizer::timeJumpedBack() {
  std::vector<PoseGuess> guesses;
  const auto addGuess = [&](PoseGuess guess) {
    guess.stamp = std::numeric_limits<double>::quiet_NaN();
    guess.widen = true;
    guess.confirmation_seconds = options_.recovery.confirmation_seconds;
    guesses.push_back(std::move(guess));
  };
  if (last_valid_) {
    // After a loop the odometry starts over: its last correction is right up to the drift, which the search
    // covers.
    addGuess(*last_valid_);
    guesses.back().source = "last pose before the time jump";
  }
  if (confirming()) {  // a place that may be another one than that of the last good pose
    PoseGuess guess;
    guess.T_map_base = motion_.lastPose();
    guess.covariance = isotropicCovariance(options_.search.rotation_sigma, options_.search.translation_sigma);
    guess.source = "pose that was not confirmed yet";
    addGuess(guess);
  }
  if (!last_valid_ && !guesses_.empty()) {  // the same jump again: clock, scans and transforms all show it
    guesses = guesses_;
  } else if (start_guess_) {
    addGuess(*start_guess_);
    guesses.back().T_odom_base.reset();
  }
  const std::optional<PoseGuess> start = start_guess_;
  const double inliers = usual_inliers_, score = usual_score_;  // the same camera in the same map
  reset();
  start_guess_ = start;
  usual_inliers_ = inliers;
  usual_score_ = score;
  guesses_ = std::move(guesses);
  if (hasMap() && !guesses_.empty()) state_ = LocalizerState::kRelocalizing;
}

LocalizationUpdate Localizer::process(const LocalizerScan& scan) {
  // Written so that NaN is rejected.
  if (!(scan.stamp > last_stamp_)) {
    LocalizationUpdate update = emptyUpdate(scan);
    update.reason = RejectionReason::kOldStamp;
    update.message = "the scan is not newer than the one before";
    return withState(update);
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
    LocalizationUpdate update = emptyUpdate(scan);
    update.reason = RejectionReason::kNoMap;
    update.message = "no map";
    return withState(update);
  }
  if (global_running_) {
    LocalizationUpdate update = emptyUpdate(scan);
    update.message = "global localization is running";
    return withState(update);
  }
  if (!guesses_.empty()) return tryGuesses(scan);
  switch (state_) {
    case LocalizerState::kLost:
      return recover(scan);
    case LocalizerState::kNoMap:
    case LocalizerState::kWaitingForPose:
      return waitForPose(scan);
    case LocalizerState::kTracking:
    case LocalizerState::kDegraded:
    case LocalizerState::kRelocalizing:
      break;
  }
  return track(scan);
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

LocalizationUpdate Localizer::applyGlobal(const GlobalJob& job) {
  LocalizationUpdate update = emptyUpdate(job.scan());
  if (!global_running_ || job.id() != global_id_) {
    update.reason = RejectionReason::kCancelled;
    update.message = "global localization: overtaken by another pose, map or reset";
    return withState(update);
  }
  global_running_ = false;
  last_global_stamp_ = last_stamp_;
  update.registration = job.result();
  update.registered = true;
  Rejection rejection = checkTermination(job.result());
  if (!rejection && !job.result().success)  // there is no prior that could count where the scan says nothing
    rejection = {RejectionReason::kDegenerate, "the scan does not fix the pose"};
  if (!rejection)
    rejection = checkFitAfterSearch(job.result(), options_.gates, options_.gates.recovery_inlier_ratio);
  if (!rejection) {
    PoseGuess guess{job.T_map_base(),
                    isotropicCovariance(0.02, 0.05),
                    job.scan().stamp,
                    job.scan().T_odom_base,
                    false,
                    "global localization",
                    options_.recovery.confirmation_seconds,
                    options_.global.max_score};
    guesses_.assign(1, std::move(guess));
    forgetUsualFit();
    guess_attempts_ = 0;
    update.T_map_base = job.T_map_base();
    update.T_map_sensor = job.result().T_map_sensor;
    update.message = "global localization found a place, confirming it";
    state_ = LocalizerState::kRelocalizing;
    return withState(update);
  }
  update.reason = rejection.reason;
  update.message = "global localization: " + rejection.message;
  if (rejection.reason == RejectionReason::kCancelled) globals_done_ = options_.recovery.global_attempts;
  if (motion_.hasPose()) {
    becomeLost(searches_done_);
  } else {
    state_ = LocalizerState::kWaitingForPose;
  }
  return withState(update);
}

std::optional<PoseGuess> Localizer::lastPose() const { return last_valid_; }

LocalizationUpdate Localizer::emptyUpdate(const LocalizerScan& scan) const {
  LocalizationUpdate update;
  update.stamp = scan.stamp;
  return update;
}

LocalizationUpdate Localizer::withState(LocalizationUpdate& update) const {
  update.state = state_;
  update.twist = motion_.twist();
  if (state_ == LocalizerState::kTracking || state_ == LocalizerState::kDegraded)
    update.T_map_odom = motion_.correction();
  return update;
}

}  // namespace ttsdf
