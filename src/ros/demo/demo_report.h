#pragma once
// What a run of the demo achieved, in figures and as text.

#include <cstdint>
#include <string>
#include <vector>

#include "ttsdf_localization/evaluation/trajectory_error.h"

namespace ttsdf {

struct DemoReport {
  // Mapping.
  double mapping_seconds = 0.0;  ///< of driving
  std::uint32_t scans_fused = 0;
  double build_seconds = 0.0;              ///< of the service call
  std::vector<std::uint32_t> dims, ranks;  ///< of the map
  std::string encoding;
  std::uint64_t map_bytes = 0;    ///< of the file that was saved
  std::uint64_t dense_bytes = 0;  ///< of the uncompressed array
  double surface_rms = 0.0;       ///< compression error within 3 cm of the surface [m]

  // Localization.
  double localization_seconds = 0.0;
  std::uint32_t scans = 0;      ///< that reached the localizer
  std::uint32_t dropped = 0;    ///< of them overtaken by a newer one
  std::uint32_t localised = 0;  ///< that gave a pose
  std::uint32_t times_lost = 0;
  std::vector<double> registration_ms;  ///< per scan
  std::vector<double> latency_ms;       ///< image stamp to status, per localised scan
  PoseSequence estimate, truth;         ///< of the base in the map
  double odometry_error = 0.0;          ///< by how far odometry alone was off in the end [m]

  double total_seconds = 0.0;
};

/// What is wrong with a run; empty: nothing. The limits are those of the demo's acceptance: poses for 95 % of
/// the scans that were not dropped, rms error of 3 cm at most.
std::vector<std::string> problems(const DemoReport& report);

/// Several lines for people; one line "FAILED: ..." per problem at the end.
std::string toText(const DemoReport& report);

}  // namespace ttsdf
