// Tracking: a scan near its prior is registered with the prior, checked, and accepted or rejected.

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "ttsdf_localization/localization/localizer.h"

namespace ttsdf {

namespace {
constexpr double kUsualGain = 0.01;
constexpr double kLeap = 2.0;  // standard deviations from the prior beyond which a pose must fit very well
constexpr double kSure = 2.0;  // standard deviations that a position may be off
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

/// Of the position, in its worst direction [m].
double largestSigma(const Matrix6d& covariance) {
  const Eigen::Matrix3d position = covariance.bottomRightCorner<3, 3>();
  return std::sqrt(position.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff());
}

PoseError setJump(const PoseEstimate& prior, LocalizationUpdate& update) {
  const PoseError jump = poseError(prior.T, update.registration.T_map_sensor);
  update.jump_translation = jump.translation;
  update.jump_rotation = jump.rotation;
  return jump;
}
}  // namespace

LocalizationUpdate Localizer::track(const LocalizerScan& scan) {
  LocalizationUpdate update = emptyUpdate(scan);
  const std::optional<Prediction> prior = motion_.predict(scan);
  if (!prior) return reject(scan, {RejectionReason::kNoPrior, "no external prior for this scan"}, update);

  update.registration = alignNear(scan, *prior);
  update.registered = true;
  Rejection rejection = checkTermination(update.registration);
  if (!rejection) {
    const PoseError jump = setJump(atSensor(scan, *prior), update);
    rejection = checkFit(update.registration, options_.gates, trackingInliers());
    if (!rejection) rejection = checkJump(jump, options_.gates);
    if (!rejection && confirming()) rejection = checkScore(update.registration, confirming_score_);
  }
  if (!rejection) rejection = checkPlausible(scan, *prior, update.registration);
  if (!rejection && returnsFromGuess(scan, update.registration)) return returnFromGuess(scan, *prior);
  if (!rejection) return accept(scan, *prior, update);

  if (!isUninformative(rejection.reason) && searchDue(scan.stamp, options_.recovery.search_period)) {
    const Prediction spread{prior->T_map_base,
                            prior->covariance + isotropicCovariance(options_.search.rotation_sigma,
                                                                    options_.search.translation_sigma)};
    LocalizationUpdate found = searchAround(scan, spread, options_.search);
    // Places further away are for those who are lost.
    if (!checkFoundNearLast(scan, found) && found.registration.score < update.registration.score &&
        !checkPlausible(scan, *prior, found.registration)) {
      found.relocalized = true;
      if (!checkJump(setJump(atSensor(scan, *prior), found), options_.gates))
        return accept(scan, *prior, found);
      // Further than motion goes: later scans have to agree.
      return acceptFound(scan, found, options_.recovery.confirmation_seconds);
    }
  }
  return reject(scan, rejection, update);
}

Rejection Localizer::checkPlausible(const LocalizerScan& scan, const Prediction& prior,
                                    const RegistrationResult& result) const {
  const PoseEstimate expected = atSensor(scan, prior);
  const double sigmas = deviation(result.T_map_sensor, expected.T, expected.covariance + result.covariance);
  // What the motion does not explain, the scan has to.
  if (sigmas <= kLeap && largestSigma(expected.covariance) <= options_.gates.max_guessed_translation)
    return {};
  if (sigmas <= kMaxDeviation) return checkFitAfterSearch(result, options_.gates, recoveryInliers());
  const PoseError jump = poseError(expected.T, result.T_map_sensor);
  char text[128];
  std::snprintf(text, sizeof(text),
                "%.2f m and %.2f rad from the prior: %.1f standard deviations, at most %.0f allowed",
                jump.translation, jump.rotation, sigmas, kMaxDeviation);
  return {RejectionReason::kJump, text};
}

RegistrationResult Localizer::alignWith(Registration& registration, const LocalizerScan& scan,
                                        const PoseEstimate& prior) {
  RegistrationResult result = registration.align(scan.points, prior.T, prior.covariance);
  const PoseEstimate inflated = inflatedToInclude(prior, result.T_map_sensor);
  // Slipping wheels: a prior that the scan contradicts beyond chance is less certain than it claims.
  if (result.success && inflated.covariance != prior.covariance) {
    const double milliseconds = result.milliseconds;
    result = registration.alignFrom(scan.points, {result.T_map_sensor},
                                    PosePrior::fromCovariance(prior.T, inflated.covariance));
    result.milliseconds += milliseconds;
  }
  return result;
}

RegistrationResult Localizer::alignNear(const LocalizerScan& scan, const Prediction& prior) {
  // The map alone first: it does not see people in front of it, which pull the far field's wide kernels away.
  const PoseEstimate expected = atSensor(scan, prior);
  RegistrationResult near = alignWith(*tracker_, scan, expected);
  Rejection rejection = checkTermination(near);
  if (!rejection) rejection = checkFit(near, options_.gates, trackingInliers());
  if (!rejection || isUninformative(rejection.reason)) return near;
  RegistrationResult far = alignWith(*registration_, scan, expected);
  far.milliseconds += near.milliseconds;
  far.iterations += near.iterations;
  return far.score < near.score && !checkPlausible(scan, prior, far) ? far : near;
}

LocalizationUpdate Localizer::accept(const LocalizerScan& scan, const Prediction& prior,
                                     LocalizationUpdate& update) {
  setJump(atSensor(scan, prior), update);
  const RegistrationResult& result = update.registration;
  fillPose(scan, {result.T_map_sensor, result.covariance}, update);
  if (const Rejection drifted = checkSinceFound(scan, update)) return reject(scan, drifted, update);
  const Rejection guessed = checkMeasured(scan, result);
  motion_.correct(scan, update.T_map_base, update.covariance, result.degenerate_directions == 0);
  rejected_in_row_ = 0;
  if (guessed) return followGuess(scan, guessed, update);
  const bool measured = motion_.guessedSigma(scan) == 0.0;  // by the scan or by the odometry
  if (measured) confirmations_left_ = std::max(0, confirmations_left_ - 1);
  if (confirmations_left_ > 0 || scan.stamp < confirmed_from_) {
    update.message = "confirming the pose found";
    return withState(update);
  }
  confirmed_from_ = kNeverStamp;
  return markValid(scan, update);
}

Rejection Localizer::checkMeasured(const LocalizerScan& scan, const RegistrationResult& result) const {
  const double sigma = motion_.guessedSigma(scan);
  if (result.degenerate_directions == 0 || kSure * sigma <= options_.gates.max_guessed_translation) return {};
  char text[192];
  std::snprintf(
      text, sizeof(text),
      "%d directions without information and no odometry: the position along them may be off by %.2f m, "
      "at most %.2f m allowed (max_guessed_translation)",
      result.degenerate_directions, kSure * sigma, options_.gates.max_guessed_translation);
  return {RejectionReason::kDegenerate, text};
}

bool Localizer::returnsFromGuess(const LocalizerScan& scan, const RegistrationResult& result) const {
  constexpr double kNear = 0.5;  // of a jump: places nearer to each other are one
  return result.degenerate_directions == 0 && motion_.isBack(scan) &&
         kSure * motion_.guessedSigma(scan) > kNear * options_.gates.max_jump_translation;
}

LocalizationUpdate Localizer::returnFromGuess(const LocalizerScan& scan, const Prediction& prior) {
  if (!searchDue(scan.stamp, options_.recovery.search_period)) {
    LocalizationUpdate update = emptyUpdate(scan);
    return followGuess(scan, {RejectionReason::kDegenerate, "guessed for long: the place has to be searched"},
                       update);
  }
  LocalizationUpdate found = searchAround(scan, prior, options_.search);
  const Rejection rejection = checkFoundNearLast(scan, found);
  if (rejection) return reject(scan, rejection, found);
  if (kSure * motion_.guessedSigma(scan) <= options_.gates.max_jump_translation)
    return accept(scan, prior, found);
  const RegistrationResult& result = found.registration;
  fillPose(scan, {result.T_map_sensor, result.covariance}, found);
  motion_.correct(scan, found.T_map_base, found.covariance);
  return startConfirming(scan, options_.recovery.confirmation_seconds, found);
}

LocalizationUpdate Localizer::followGuess(const LocalizerScan& scan, const Rejection& rejection,
                                          LocalizationUpdate& update) {
  update.reason = rejection.reason;
  update.message = rejection.message;
  if (scan.stamp - motion_.measuredStamp() >= options_.recovery.coast_seconds) {
    stopConfirming();
    becomeLost(0);
  } else if (!confirming()) {
    state_ = LocalizerState::kDegraded;
  }
  return withState(update);
}

LocalizationUpdate Localizer::acceptFound(const LocalizerScan& scan, LocalizationUpdate& update,
                                          double seconds) {
  const auto& search = options_.search;
  const Matrix6d spread = isotropicCovariance(search.rotation_sigma, search.translation_sigma);
  const RegistrationResult& result = update.registration;
  fillPose(scan, {result.T_map_sensor, covarianceBoundedBy(result.covariance, spread)}, update);
  motion_.setPose(scan, update.T_map_base, update.covariance);
  return startConfirming(scan, seconds, update);
}

LocalizationUpdate Localizer::startConfirming(const LocalizerScan& scan, double seconds,
                                              LocalizationUpdate& update) {
  update.relocalized = true;
  guesses_.clear();
  guess_attempts_ = rejected_in_row_ = 0;
  confirmations_left_ = options_.recovery.confirmation_scans;
  confirming_inliers_ = recoveryInliers();
  confirming_score_ = 1.0;
  found_ = {update.T_map_base, update.covariance, scan.stamp, scan.T_odom_base, false, "pose found"};
  confirmed_from_ = seconds > 0.0 ? scan.stamp + seconds : kNeverStamp;
  if (!confirming()) return markValid(scan, update);
  state_ = LocalizerState::kRelocalizing;
  update.message = "confirming the pose found";
  return withState(update);
}

LocalizationUpdate Localizer::markValid(const LocalizerScan& scan, LocalizationUpdate& update) {
  state_ = LocalizerState::kTracking;
  searches_done_ = globals_done_ = 0;
  // Rises at once and falls slowly: people in front of the camera do not lower what is usual.
  const double inliers = update.registration.inlier_ratio;
  usual_inliers_ = std::max(inliers, usual_inliers_ + kUsualGain * (inliers - usual_inliers_));
  const double score = update.registration.score;
  usual_score_ = std::min(score, usual_score_ + kUsualGain * (score - usual_score_));
  update.pose_valid = true;
  last_valid_ =
      PoseGuess{update.T_map_base, update.covariance, scan.stamp, scan.T_odom_base, true, "last pose"};
  if (update.registration.degenerate_directions > 0) {
    update.message = std::to_string(update.registration.degenerate_directions) +
                     " directions with little information: the prior counts there";
  }
  return withState(update);
}

LocalizationUpdate Localizer::reject(const LocalizerScan& scan, const Rejection& rejection,
                                     LocalizationUpdate& update) {
  update.reason = rejection.reason;
  update.message = rejection.message;
  ++rejected_in_row_;
  const bool uninformative = isUninformative(rejection.reason) && scan.T_odom_base;
  const bool brief = scan.stamp - motion_.lastStamp() < options_.recovery.lost_after_seconds;
  if (confirming() && uninformative && brief) return withState(update);  // a hand over the lens
  if (confirming()) {
    stopConfirming();
    becomeLost(searches_done_);
    update.message = "the pose found was not confirmed: " + rejection.message;
    return withState(update);
  }
  // A scan that says nothing does not speak against the odometry, and interrupts those that do.
  const auto& recovery = options_.recovery;
  if (uninformative) last_uninformative_stamp_ = scan.stamp;
  const double since_good = scan.stamp - motion_.lastStamp();
  const double contradicted = std::min(since_good, scan.stamp - last_uninformative_stamp_);
  const bool lost = rejected_in_row_ >= recovery.lost_after_scans &&
                    (since_good >= std::max(recovery.coast_seconds, recovery.lost_after_seconds) ||
                     (!uninformative && contradicted >= recovery.lost_after_seconds));
  if (lost) {
    becomeLost(0);
  } else {
    state_ = LocalizerState::kDegraded;
  }
  return withState(update);
}

Rejection Localizer::checkSinceFound(const LocalizerScan& scan, const LocalizationUpdate& update) const {
  if (!confirming() || !found_.T_odom_base || !scan.T_odom_base) return {};
  const Prediction expected = motion_.predict(found_, scan);
  const Matrix6d covariance = expected.covariance + update.covariance;
  if (deviation(update.T_map_base, expected.T_map_base, covariance) <= kLeap) return {};
  const PoseError apart = poseError(expected.T_map_base, update.T_map_base);
  char text[128];
  std::snprintf(text, sizeof(text),
                "since it was found the scans moved otherwise than the odometry, by %.2f m and %.2f rad",
                apart.translation, apart.rotation);
  return {RejectionReason::kJump, text};
}

bool Localizer::confirming() const { return confirmations_left_ > 0 || confirmed_from_ != kNeverStamp; }

void Localizer::stopConfirming() {
  confirmations_left_ = 0;
  confirmed_from_ = kNeverStamp;
}

void Localizer::forgetUsualFit() {
  usual_inliers_ = 0.0;
  usual_score_ = 1.0;
}

void Localizer::becomeLost(int searches_done) {
  state_ = LocalizerState::kLost;
  searches_done_ = searches_done;
  rejected_in_row_ = 0;
  motion_.stop();
}

double Localizer::trackingInliers() const {
  // A pose still to be confirmed is held to the standard it was found by.
  if (confirming()) return confirming_inliers_;
  return std::max(options_.gates.min_inlier_ratio, options_.gates.min_relative_inliers * usual_inliers_);
}

double Localizer::recoveryInliers() const {
  return std::max(options_.gates.recovery_inlier_ratio,
                  options_.gates.recovery_relative_inliers * usual_inliers_);
}

void Localizer::fillPose(const LocalizerScan& scan, const PoseEstimate& sensor, LocalizationUpdate& update) {
  update.T_map_sensor = sensor.T;
  update.T_map_base = sensor.T * scan.T_base_sensor.inverse();
  const Matrix6d at_base = movedCovariance(sensor.covariance, baseFromSensor(update));
  update.covariance = 0.5 * (at_base + at_base.transpose());
}

}  // namespace ttsdf
