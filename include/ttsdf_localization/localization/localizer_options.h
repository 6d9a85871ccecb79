#pragma once
// Options of the localizer, grouped as in the YAML file: gates/, motion/, recovery/, registration/, search/,
// global/.

#include <string>

#include "ttsdf_localization/options/option_table.h"
#include "ttsdf_localization/registration/registration.h"
#include "ttsdf_localization/registration/search.h"

namespace ttsdf {

/// When a registered scan is accepted.
struct GateOptions {
  double max_rms_residual = 0.0;        ///< of the inliers [m]; 0: 0.7 of the distance that makes an inlier
  double min_confidence = 0.4;          ///< of the verification, near the prior
  double recovery_confidence = 0.75;    ///< the same after a search or far from the prior
  double min_inlier_ratio = 0.35;       ///< inliers / points in known space, while tracking
  double recovery_inlier_ratio = 0.55;  ///< the same after a search, where a wrong place may fit a little
  double min_relative_inliers = 0.6;    ///< inlier ratio against its usual value, while tracking
  double recovery_relative_inliers =
      0.9;                           ///< the same after a search near the last pose: a wrong place fits worse
  double max_unmapped_ratio = 0.85;  ///< points outside the map, in unknown space or behind surfaces / points
  double recovery_unmapped_ratio = 0.6;  ///< the same after a search: a place has to explain the scan
  double recovery_behind_ratio = 0.1;    ///< points behind mapped surfaces / points, after a search
  double recovery_score_margin = 0.15;   ///< score against its usual value, after a search near the last pose
  double max_jump_translation = 0.5;     ///< pose against its prior [m]
  double max_jump_rotation = 0.35;       ///< [rad]
  double max_guessed_translation = 0.1;  ///< without odometry, along directions that scans do not fix [m]
  int max_degenerate_directions = 3;     ///< one wall or a floor leaves 3, a corridor 1
};
const OptionTable<GateOptions>& gateOptionTable();

/// Where the prior of the next scan comes from, and how much it is trusted.
struct MotionOptions {
  std::string prior = "odometry";                   ///< odometry | constant_velocity | external
  double odometry_translation_noise = 0.1;          ///< standard deviation per distance driven [m/m]
  double odometry_rotation_noise = 0.1;             ///< per angle turned [rad/rad]
  double odometry_rotation_noise_per_metre = 0.05;  ///< per distance driven [rad/m]
  double velocity_translation_noise = 0.5;  ///< without odometry: most standard deviation per time [m/s]
  double velocity_rotation_noise = 0.5;     ///< [rad/s]
  double acceleration = 4.0;                ///< of a moving camera, standard deviation [m/s^2]
  double angular_acceleration = 10.0;       ///< [rad/s^2]
  double max_extrapolation = 0.5;           ///< a velocity is carried on for at most this time [s]
};
const OptionTable<MotionOptions>& motionOptionTable();

/// What happens when scans are rejected.
struct RecoveryOptions {
  double lost_after_seconds = 0.7;  ///< without a good scan [s] ...
  int lost_after_scans = 3;         ///< ... and at least this many rejected ones: lost
  double coast_seconds = 5.0;  ///< the same when scans say nothing, or none come, but odometry goes on [s]
  bool lost_without_scans = true;      ///< no scan for coast_seconds: lost; false: degraded for ever
  double search_period = 0.2;          ///< least time between two searches near the prior [s]
  int search_attempts = 5;             ///< searches near the prior before the next rung
  double search_growth = 1.5;          ///< the spread of the starts grows by this factor per attempt
  bool allow_global = true;            ///< global localization starts by itself when lost
  bool start_globally = false;         ///< ... and when there is no start pose
  int global_attempts = 3;             ///< global localizations in a row before waiting for a pose
  double global_retry_seconds = 2.0;   ///< pause between two of them [s]
  double waiting_retry_seconds = 5.0;  ///< while waiting: search near the last pose this often [s]; 0: never
  int confirmation_scans = 2;          ///< scans that must agree after a search before poses are published
  double confirmation_seconds = 0.5;   ///< ... and for how long, where nobody said the camera is there [s]
  int start_attempts = 10;             ///< scans tried on a start pose
  int start_starts = 256;              ///< starts around a start pose
  double start_translation_sigma = 0.3;  ///< least spread around a start pose: x, y [m]
  double start_height_sigma = 0.5;       ///< z, which rviz gives as 0 [m]
  double start_yaw_sigma = 0.15;         ///< [rad]
  double start_tilt_sigma = 0.1;         ///< roll and pitch [rad]
};
const OptionTable<RecoveryOptions>& recoveryOptionTable();

struct LocalizerOptions {
  GateOptions gates;
  MotionOptions motion;
  RecoveryOptions recovery;
  RegistrationOptions registration;
  SearchOptions search;
  GlobalOptions global;
  double map_down_x = 0.0;  ///< down direction in the map frame, for the gravity hint
  double map_down_y = 0.0;
  double map_down_z = -1.0;

  Eigen::Vector3d mapDown() const { return {map_down_x, map_down_y, map_down_z}; }
};
/// The fields of LocalizerOptions itself (not of its groups).
const OptionTable<LocalizerOptions>& localizerOptionTable();

/// Checks every group. Throws std::invalid_argument naming group, key, value and range.
void validate(const LocalizerOptions& options);

}  // namespace ttsdf
