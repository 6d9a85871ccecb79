#include "ttsdf_localization/localization/localizer_options.h"

#include <stdexcept>

namespace ttsdf {

namespace {
template <class Options>
void validateGroup(const std::string& group, const OptionTable<Options>& table, const Options& options) {
  try {
    table.validate(options);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(group + "/: " + error.what());
  }
}
}  // namespace

const OptionTable<GateOptions>& gateOptionTable() {
  using O = GateOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("max_rms_residual", &O::max_rms_residual, 0.0, 1.0, "m",
               "Largest rms residual of the inliers; 0: 0.7 of the distance that makes an inlier.")
          .add("min_confidence", &O::min_confidence, 0.0, 1.0, "",
               "Least confidence of the verification while tracking.")
          .add("recovery_confidence", &O::recovery_confidence, 0.0, 1.0, "",
               "The same after a search or for a pose that the prior does not expect.")
          .add("min_inlier_ratio", &O::min_inlier_ratio, 0.0, 1.0, "",
               "Least share of inliers among the points in known space while tracking.")
          .add("recovery_inlier_ratio", &O::recovery_inlier_ratio, 0.0, 1.0, "",
               "The same after a search, where a wrong place may fit a little.")
          .add("min_relative_inliers", &O::min_relative_inliers, 0.0, 1.0, "",
               "Least inlier ratio against its usual value while tracking.")
          .add("recovery_relative_inliers", &O::recovery_relative_inliers, 0.0, 1.0, "",
               "The same after a search near the last pose: a wrong place fits worse than the right one did.")
          .add("max_unmapped_ratio", &O::max_unmapped_ratio, 0.0, 1.0, "",
               "Largest share of points outside the map, in unknown space or behind surfaces.")
          .add("recovery_unmapped_ratio", &O::recovery_unmapped_ratio, 0.0, 1.0, "",
               "The same after a search: a place found has to explain the scan")
          .add("recovery_behind_ratio", &O::recovery_behind_ratio, 0.0, 1.0, "",
               "Largest share of points behind mapped surfaces, as the scan sees them, after a search")
          .add("recovery_score_margin", &O::recovery_score_margin, 0.0, 1.0, "",
               "A place found near the last pose may have a score that is worse than usual by this")
          .add("max_jump_translation", &O::max_jump_translation, 0.0, 100.0, "m",
               "Largest distance of a tracked pose from its prior.")
          .add("max_jump_rotation", &O::max_jump_rotation, 0.0, 3.15, "rad",
               "Largest angle of a tracked pose from its prior.")
          .add("max_guessed_translation", &O::max_guessed_translation, 0.0, 100.0, "m",
               "Without odometry, along directions that scans do not fix, the position is the last velocity "
               "carried on: no pose is published when it may be off by more than this (two standard "
               "deviations).")
          .add("max_degenerate_directions", &O::max_degenerate_directions, 0, 6, "",
               "Most directions without information: one wall or a floor leaves 3, a corridor 1.");
  return table;
}

const OptionTable<MotionOptions>& motionOptionTable() {
  using O = MotionOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("prior", &O::prior, {"odometry", "constant_velocity", "external"},
               "Where the prior of a scan comes from: odometry (TF odom -> base; constant velocity while it "
               "is "
               "missing), constant_velocity, or external (TF map -> base published by somebody else).")
          .add("odometry_translation_noise", &O::odometry_translation_noise, 0.0, 10.0, "m/m",
               "Standard deviation of the odometry per distance driven.")
          .add("odometry_rotation_noise", &O::odometry_rotation_noise, 0.0, 10.0, "rad/rad",
               "Standard deviation of the odometry's rotation per angle turned.")
          .add("odometry_rotation_noise_per_metre", &O::odometry_rotation_noise_per_metre, 0.0, 10.0, "rad/m",
               "Standard deviation of the odometry's rotation per distance driven.")
          .add("velocity_translation_noise", &O::velocity_translation_noise, 0.0, 100.0, "m/s",
               "Without odometry: largest standard deviation of the predicted position per time; more after "
               "motion that was less steady.")
          .add("velocity_rotation_noise", &O::velocity_rotation_noise, 0.0, 100.0, "rad/s",
               "Without odometry: largest standard deviation of the predicted rotation per time.")
          .add("acceleration", &O::acceleration, 0.0, 1000.0, "m/s^2",
               "Without odometry: how much the velocity may change; where it is known the prediction is the "
               "better the more often scans come.")
          .add("angular_acceleration", &O::angular_acceleration, 0.0, 1000.0, "rad/s^2",
               "The same of the rotation.")
          .add("max_extrapolation", &O::max_extrapolation, 0.0, 10.0, "s",
               "A velocity is carried on for at most this time.");
  return table;
}

const OptionTable<RecoveryOptions>& recoveryOptionTable() {
  using O = RecoveryOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("lost_after_seconds", &O::lost_after_seconds, 0.0, 3600.0, "s",
               "Lost after this time without a good scan ...")
          .add("lost_after_scans", &O::lost_after_scans, 1, 100000, "",
               "... and at least this many refused scans.")
          .add("coast_seconds", &O::coast_seconds, 0.0, 3600.0, "s",
               "The same while scans say nothing (covered camera, unmapped area) but odometry goes on.")
          .add("lost_without_scans", &O::lost_without_scans,
               "No scan at all for coast_seconds: lost, and no transform. false: degraded, and the transform "
               "stays.")
          .add("search_period", &O::search_period, 0.0, 60.0, "s",
               "Least time between two searches near the prior.")
          .add("search_attempts", &O::search_attempts, 0, 1000, "",
               "Searches near the prior when lost, before global localization.")
          .add("search_growth", &O::search_growth, 1.0, 10.0, "",
               "The spread of the starts grows by this factor with every attempt.")
          .add("allow_global", &O::allow_global, "Global localization starts by itself when lost.")
          .add("start_globally", &O::start_globally,
               "Global localization starts by itself when there is no start pose.")
          .add("global_attempts", &O::global_attempts, 0, 1000, "",
               "Global localizations in a row before waiting for a pose.")
          .add("global_retry_seconds", &O::global_retry_seconds, 0.0, 3600.0, "s",
               "Pause between two of them.")
          .add("waiting_retry_seconds", &O::waiting_retry_seconds, 0.0, 3600.0, "s",
               "While waiting for a pose: search near the last one this often; 0: never.")
          .add("confirmation_scans", &O::confirmation_scans, 0, 100, "",
               "Scans that must agree after a search before poses are published.")
          .add("confirmation_seconds", &O::confirmation_seconds, 0.0, 60.0, "s",
               "... and for this long, unless the place was given from outside")
          .add("start_attempts", &O::start_attempts, 1, 1000, "",
               "Scans tried on a start pose before it is refused.")
          .add("start_starts", &O::start_starts, 1, 100000, "", "Starts of the search around a start pose.")
          .add("start_translation_sigma", &O::start_translation_sigma, 0.0, 100.0, "m",
               "Least spread around a start pose, horizontally.")
          .add("start_height_sigma", &O::start_height_sigma, 0.0, 100.0, "m",
               "Least spread in height, which rviz gives as 0.")
          .add("start_yaw_sigma", &O::start_yaw_sigma, 0.0, 3.15, "rad", "Least spread of the heading.")
          .add("start_tilt_sigma", &O::start_tilt_sigma, 0.0, 3.15, "rad", "Least spread of roll and pitch.");
  return table;
}

const OptionTable<LocalizerOptions>& localizerOptionTable() {
  using O = LocalizerOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("map_down_x", &O::map_down_x, -1.0, 1.0, "", "Down direction in the map frame, x.")
          .add("map_down_y", &O::map_down_y, -1.0, 1.0, "", "Down direction in the map frame, y.")
          .add("map_down_z", &O::map_down_z, -1.0, 1.0, "", "Down direction in the map frame, z.");
  return table;
}

void validate(const LocalizerOptions& options) {
  validateGroup("gates", gateOptionTable(), options.gates);
  validateGroup("motion", motionOptionTable(), options.motion);
  validateGroup("recovery", recoveryOptionTable(), options.recovery);
  validateGroup("registration", registrationOptionTable(), options.registration);
  validateGroup("search", searchOptionTable(), options.search);
  validateGroup("global", globalOptionTable(), options.global);
  localizerOptionTable().validate(options);
  if (options.mapDown().norm() < 0.1) {
    throw std::invalid_argument(
        "options 'map_down_x', 'map_down_y', 'map_down_z': got a direction of length " +
        std::to_string(options.mapDown().norm()) + ", wanted one of about 1");
  }
}

}  // namespace ttsdf
