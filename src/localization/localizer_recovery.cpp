// The way back: guesses from outside, searches near the prior, the request for a global localization,
// waiting.

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <utility>

#include "ttsdf_localization/localization/localizer.h"
#include "ttsdf_localization/localization/pose_covariance.h"

namespace ttsdf {

namespace {
// Beyond this spread the starts are too thin to find anything: that is the global localization's job.
constexpr double kMaxSearchTranslation = 2.0;  // [m]
constexpr double kMaxSearchRotation = 0.6;     // [rad]

std::string figures(const PoseError& jump) {
  std::ostringstream text;
  text << std::setprecision(2) << jump.translation << " m, " << jump.rotation << " rad";
  return text.str();
}

std::string joined(const std::vector<PoseGuess>& guesses) {
  std::string text;
  for (const auto& guess : guesses) text += (text.empty() ? "" : ", ") + guess.source;
  return text;
}
}  // namespace

bool Localizer::searchDue(double stamp, double period) {
  if (stamp - last_search_stamp_ < period) return false;
  last_search_stamp_ = stamp;
  return true;
}

bool Localizer::isAmbiguous(const RegistrationResult& best, const Eigen::Isometry3d& T_prior,
                            const Matrix6d& covariance) const {
  constexpr double kTells = 9.0;  // difference of squared deviations: odds of 90 to 1
  if (best.runner_up_score - best.score - best.blocked_ratio >= options_.global.min_margin) return false;
  const double here = deviation(best.T_map_sensor, T_prior, covariance);
  const double there = deviation(best.T_map_runner_up, T_prior, covariance);
  return there <= kMaxDeviation && there * there - here * here < kTells;
}

LocalizationUpdate Localizer::searchAround(const LocalizerScan& scan, const Prediction& candidate,
                                           const SearchOptions& search) {
  LocalizationUpdate found = emptyUpdate(scan);
  const Eigen::Isometry3d T_map_sensor = candidate.T_map_base * scan.T_base_sensor;
  const Matrix6d covariance =
      movedCovariance(candidate.covariance, T_map_sensor.translation() - candidate.T_map_base.translation());
  found.registration = searchNear(*registration_, scan.points, T_map_sensor, search, covariance);
  found.registered = true;
  const PoseError jump = poseError(T_map_sensor, found.registration.T_map_sensor);
  found.jump_translation = jump.translation;
  found.jump_rotation = jump.rotation;
  if (!(deviation(found.registration.T_map_sensor, T_map_sensor, covariance) <= kMaxDeviation)) {
    found.reason = RejectionReason::kJump;
    found.message = "the best fit lies too far away (" + figures(jump) + ") to be meant";
  } else if (isAmbiguous(found.registration, T_map_sensor, covariance)) {
    found.reason = RejectionReason::kAmbiguous;
    found.message = "another place fits alike (" +
                    figures(poseError(found.registration.T_map_sensor, found.registration.T_map_runner_up)) +
                    " away), and the prior does not tell them apart";
  }
  return found;
}

Prediction Localizer::withLeastSpread(Prediction prediction) const {
  // Height and tilt are meant against gravity: the floor is applied in a frame whose z points up.
  const auto& recovery = options_.recovery;
  Eigen::Matrix3d R_map_up =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), -options_.mapDown()).toRotationMatrix();
  Matrix6d to_map = Matrix6d::Zero();
  to_map.topLeftCorner<3, 3>() = R_map_up;
  to_map.bottomRightCorner<3, 3>() = R_map_up;
  Vector6d least;
  least << recovery.start_tilt_sigma, recovery.start_tilt_sigma, recovery.start_yaw_sigma,
      recovery.start_translation_sigma, recovery.start_translation_sigma, recovery.start_height_sigma;
  Matrix6d in_up = to_map.transpose() * prediction.covariance * to_map;
  in_up.diagonal() = in_up.diagonal().cwiseMax(least.cwiseAbs2());
  prediction.covariance = to_map * in_up * to_map.transpose();
  return prediction;
}

Prediction Localizer::recoveryPrior(const Prediction& prediction) const {
  const double growth = std::pow(options_.recovery.search_growth, searches_done_);
  return {prediction.T_map_base,
          isotropicCovariance(std::min(kMaxSearchRotation, options_.search.rotation_sigma * growth),
                              std::min(kMaxSearchTranslation, options_.search.translation_sigma * growth))};
}

Rejection Localizer::searchGuesses(const LocalizerScan& scan, LocalizationUpdate& best) {
  SearchOptions search = options_.search;
  search.starts = std::max(1, options_.recovery.start_starts / static_cast<int>(guesses_.size()));
  Rejection rejection, ambiguous;
  bool known = false;  // odometry says where the camera went since the best guess was true
  for (const PoseGuess& guess : guesses_) {
    const Prediction prediction = motion_.predict(guess, scan);
    LocalizationUpdate found =
        searchAround(scan, guess.widen ? withLeastSpread(prediction) : prediction, search);
    Rejection its_rejection = checkFound(found);
    if (!its_rejection) its_rejection = checkScore(found.registration, guess.max_score);
    bool better = !best.registered || found.registration.score < best.registration.score;
    if (best.registered && !rejection != !its_rejection) {
      better = !its_rejection;  // what may be meant comes before what may not
    } else if (best.registered && !its_rejection && fitsAlike(best, found)) {
      better = false;
      if (!known) ambiguous = {RejectionReason::kAmbiguous, "two of these places fit alike"};
    }
    if (!better) continue;
    best = std::move(found);
    rejection = its_rejection;
    known = guess.T_odom_base && scan.T_odom_base;
  }
  return rejection ? rejection : ambiguous;
}

bool Localizer::fitsAlike(const LocalizationUpdate& a, const LocalizationUpdate& b) const {
  // Bare walls fit in many places.
  return std::abs(a.registration.score - b.registration.score) < options_.global.min_margin &&
         checkJump(poseError(a.registration.T_map_sensor, b.registration.T_map_sensor), options_.gates);
}

LocalizationUpdate Localizer::tryGuesses(const LocalizerScan& scan) {
  LocalizationUpdate update = emptyUpdate(scan);
  state_ = LocalizerState::kRelocalizing;
  update.message = "trying " + joined(guesses_);
  if (!searchDue(scan.stamp, options_.recovery.search_period)) return withState(update);

  const Rejection rejection = searchGuesses(scan, update);
  if (!rejection) {
    double seconds = 0.0, score = 0.0;
    for (const PoseGuess& guess : guesses_) {
      seconds = std::max(seconds, guess.confirmation_seconds);
      score = std::max(score, guess.max_score);
    }
    const LocalizationUpdate accepted = acceptFound(scan, update, seconds);
    confirming_score_ = score;
    return accepted;
  }
  update.reason = rejection.reason;
  update.message = joined(guesses_) + ": " + rejection.message;
  // A scan that says nothing says nothing against the guess either.
  if (rejection.reason != RejectionReason::kTooFewPoints &&
      ++guess_attempts_ >= options_.recovery.start_attempts) {
    guesses_.clear();
    becomeLost(options_.recovery.search_attempts);
  }
  return withState(update);
}

Rejection Localizer::checkFoundNearLast(const LocalizerScan& scan, const LocalizationUpdate& found) const {
  if (Rejection rejection = checkFound(found)) return rejection;
  return checkMeasured(scan, found.registration);
}

Rejection Localizer::checkFound(const LocalizationUpdate& found) const {
  if (!found.registered) return {RejectionReason::kNoPrior, "no pose to search around"};
  if (Rejection rejection = checkTermination(found.registration)) return rejection;
  if (Rejection rejection = checkFitAfterSearch(found.registration, options_.gates, recoveryInliers()))
    return rejection;
  if (found.reason != RejectionReason::kNone) return {found.reason, found.message};
  const double most = usual_score_ + options_.gates.recovery_score_margin;
  if (found.registration.score <= most) return {};
  std::ostringstream text;
  text << std::setprecision(2) << "score " << found.registration.score << ", at most " << most
       << " allowed: usual is " << usual_score_ << " (recovery_score_margin)";
  return {RejectionReason::kLowScore, text.str()};
}

LocalizationUpdate Localizer::recover(const LocalizerScan& scan) {
  LocalizationUpdate update = emptyUpdate(scan);
  const std::optional<Prediction> prior = motion_.predict(scan);
  if (!prior || searches_done_ >= options_.recovery.search_attempts) return escalate(scan, update);
  if (!searchDue(scan.stamp, options_.recovery.search_period)) {
    update.message = "lost: searching near the last pose";
    return withState(update);
  }
  update = searchAround(scan, recoveryPrior(*prior), options_.search);
  const Rejection rejection = checkFoundNearLast(scan, update);
  if (!rejection) return acceptFound(scan, update, options_.recovery.confirmation_seconds);
  if (rejection.reason != RejectionReason::kTooFewPoints) ++searches_done_;
  update.reason = rejection.reason;
  update.message = "lost, searching near the last pose: " + rejection.message;
  return withState(update);
}

LocalizationUpdate Localizer::escalate(const LocalizerScan& scan, LocalizationUpdate& update) {
  const auto& recovery = options_.recovery;
  update.reason = RejectionReason::kNoStartPose;
  if (!recovery.allow_global || globals_done_ >= recovery.global_attempts) {
    state_ = LocalizerState::kWaitingForPose;
    update.message = "waiting for a pose: nothing found near the last one";
    if (recovery.allow_global) update.message += " and not by global localization";
    return withState(update);
  }
  const bool enough = scan.points.cols() >= options_.registration.min_points;
  update.wants_global = enough && last_stamp_ - last_global_stamp_ >= recovery.global_retry_seconds;
  update.message = enough ? "global localization is next" : "too few points for a global localization";
  return withState(update);
}

LocalizationUpdate Localizer::waitForPose(const LocalizerScan& scan) {
  const auto& recovery = options_.recovery;
  LocalizationUpdate update = emptyUpdate(scan);
  if (!motion_.hasPose() && recovery.start_globally && globals_done_ < recovery.global_attempts) {
    return escalate(scan, update);
  }
  update.reason = RejectionReason::kNoStartPose;
  const std::optional<Prediction> prior = motion_.predict(scan);
  if (prior && recovery.waiting_retry_seconds > 0.0 &&
      searchDue(scan.stamp, recovery.waiting_retry_seconds)) {
    LocalizationUpdate found = searchAround(scan, recoveryPrior(*prior), options_.search);
    if (!checkFoundNearLast(scan, found)) return acceptFound(scan, found, recovery.confirmation_seconds);
  }
  update.message = "waiting for a pose: initialpose, ~relocalize or ~global_localization";
  return withState(update);
}

}  // namespace ttsdf
