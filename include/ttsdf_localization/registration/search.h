#pragma once
// Many starts: around a prior (search) and over the whole map (global localization).

#include <functional>
#include <optional>

#include "ttsdf_localization/registration/registration.h"

namespace ttsdf {

struct SearchOptions {
  int starts = 64;
  double translation_sigma = 0.5;  ///< spread of the starts around the prior [m]
  double rotation_sigma = 0.15;    ///< [rad]
  int coarse_points = 300;
  int refined = 3;  ///< best starts refined on all points
  int seed = 1;
};
const OptionTable<SearchOptions>& searchOptionTable();

struct GlobalOptions {
  int starts = 1500;  ///< with gravity known; up to 32 times as many in a large place, twice that if unsure
  int starts_without_gravity = 14000;
  int coarse_points = 300;
  int refined = 12;
  double tilt_sigma = 0.1;   ///< trust in the gravity hint [rad]
  double min_margin = 0.02;  ///< score + blocked_ratio of the runner-up must be worse by this much
  double max_score = 0.35;   ///< a worse best score + blocked_ratio is rejected
  double min_confidence = 0.9;
  int threads = 2;
  int seed = 1;
};
const OptionTable<GlobalOptions>& globalOptionTable();

/// Called with the share done [0, 1]; returns false to cancel.
using ProgressCallback = std::function<bool(double)>;

/// Best of many starts around the prior (a descent of the coarse points from each). `covariance` (left
/// perturbation [rotation; translation] about the sensor, optional) replaces the option's sigmas. Throws
/// std::invalid_argument for options out of range; never for bad points. Not thread-safe, as `registration`.
RegistrationResult searchNear(Registration& registration, const ScanPoints& points,
                              const Eigen::Isometry3d& T_map_sensor_prior, const SearchOptions& options,
                              const std::optional<Matrix6d>& covariance = std::nullopt);

/// No prior at all. Candidates are told apart by score + blocked_ratio: rays that end on surfaces, and that
/// got there through free space. `gravity`: the down direction in the sensor frame; `map_down`: in the map
/// frame. reason kAmbiguous or kLowScore and success false when the answer cannot be trusted.
RegistrationResult localizeGlobally(Registration& registration, const ScanPoints& points,
                                    const std::optional<Eigen::Vector3d>& gravity,
                                    const Eigen::Vector3d& map_down, const GlobalOptions& options,
                                    const ProgressCallback& progress = {});

}  // namespace ttsdf
