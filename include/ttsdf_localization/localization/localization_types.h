#pragma once
// What goes into the localizer and what comes out.

#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "ttsdf_localization/registration/registration.h"

namespace ttsdf {

/// Stamp of what has not happened yet [s].
constexpr double kNeverStamp = -std::numeric_limits<double>::infinity();

enum class LocalizerState : std::uint8_t {
  kNoMap,
  kWaitingForPose,
  kTracking,
  kDegraded,
  kLost,
  kRelocalizing
};
const char* name(LocalizerState state);  ///< "no_map", "waiting_for_pose", ...

enum class RejectionReason : std::uint8_t {
  kNone,
  kNotConverged,
  kTooFewPoints,
  kOutsideMap,  ///< too many points outside the map or in unknown space
  kResidual,
  kInliers,
  kJump,
  kDegenerate,
  kAmbiguous,  ///< two places look alike
  kLowScore,   ///< no place explains the scan
  kCancelled,
  kNoStartPose,
  kNoMap,
  kOldStamp,  ///< not newer than the scan before
  kNoPrior,   ///< prior "external" and none given
  kNoScan,    ///< no usable scan for some time
};
const char* name(RejectionReason reason);

struct LocalizerScan {
  double stamp = 0.0;  ///< [s]
  ScanPoints points;   ///< sensor frame [m]
  Eigen::Isometry3d T_base_sensor = Eigen::Isometry3d::Identity();
  std::optional<Eigen::Isometry3d> T_odom_base;       ///< odometry at the stamp
  std::optional<Eigen::Isometry3d> T_map_base_prior;  ///< prior "external" only
};

/// A pose from outside: a start pose, a click in rviz, the result of a global localization.
struct PoseGuess {
  Eigen::Isometry3d T_map_base = Eigen::Isometry3d::Identity();
  Matrix6d covariance =
      Matrix6d::Zero();  ///< left perturbation [rotation; translation] about the base's position
  /// Time the pose was true [s]; NaN: at the next scan. Motion since then widens the search if odometry is
  /// missing.
  double stamp = std::numeric_limits<double>::quiet_NaN();
  std::optional<Eigen::Isometry3d> T_odom_base;  ///< odometry at that time: the motion since then is added
  bool widen = true;                  ///< apply the least spread of the recovery options (start_*_sigma)
  std::string source;                 ///< for messages: "initialpose", "start pose", ...
  double confirmation_seconds = 0.0;  ///< what is found has to hold for this long before poses are published
  double max_score = 1.0;             ///< meanwhile, of every scan: nobody said that the camera is there
};

struct LocalizationUpdate {
  double stamp = 0.0;  ///< of the scan [s]
  LocalizerState state = LocalizerState::kNoMap;
  RejectionReason reason = RejectionReason::kNone;
  std::string message;                                             ///< why, with figures
  bool pose_valid = false;                                         ///< this scan gave a pose that may be used
  Eigen::Isometry3d T_map_base = Eigen::Isometry3d::Identity();    ///< if pose_valid
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();  ///< if pose_valid
  /// The correction in use; present while it may be broadcast (tracking, degraded) and odometry is known.
  std::optional<Eigen::Isometry3d> T_map_odom;
  Matrix6d covariance =
      Matrix6d::Zero();  ///< of T_map_base: left perturbation [rotation; translation] about the base
  Vector6d twist = Vector6d::Zero();  ///< of the base in its own frame [rad/s; m/s]
  RegistrationResult registration;    ///< of the last attempt
  double jump_translation = 0.0;      ///< the pose above against its prior [m]
  double jump_rotation = 0.0;         ///< [rad]
  bool registered = false;            ///< `registration` belongs to this scan
  bool relocalized = false;           ///< the pose was found by a search
  bool wants_global = false;          ///< the caller may run Localizer::beginGlobal now
};

}  // namespace ttsdf
