#pragma once
// Which map am I in, and where: global localization over an atlas.

#include <functional>

#include "ttsdf_localization/atlas/place_index.h"
#include "ttsdf_localization/registration/search.h"

namespace ttsdf {

struct AtlasSearchOptions {
  int max_maps = 4;         ///< maps that are searched, in the order of the index
  double same_place = 0.5;  ///< poses of two maps this near to each other are one answer [m]
  /// Maps that differ more from the scan (index) need not be searched. Where max_maps ends before that,
  /// nothing is accepted (kUnsure): a map that fits may not be the only one.
  double excluded_difference = 0.45;
  /// A worse best score + blocked_ratio is refused (kLowScore). Stricter than in one map: of many maps some
  /// wrong place fits half the scan.
  double max_score = 0.25;
  double min_margin = 0.02;  ///< score + blocked_ratio of another place must be worse by this much
  RegistrationOptions registration;
  GlobalOptions global;
};

/// A place that explains the scan.
struct AtlasCandidate {
  std::string map;
  Eigen::Isometry3d T_atlas_sensor = Eigen::Isometry3d::Identity();
  RegistrationResult result;  ///< in the map's own frame
  double score() const { return result.score + result.blocked_ratio; }
};

struct AtlasLocation {
  /// kConverged: the first candidate is the pose. kAmbiguous: the candidates look alike, motion must decide.
  /// kLowScore, kUnsure, kTooFewPoints, kCancelled: as of global localization in the best map.
  TerminationReason reason = TerminationReason::kLowScore;
  bool success = false;
  std::vector<AtlasCandidate> candidates;  ///< distinct places, the best first
};

/// Gives a map by its name, loaded or in memory; null field: it cannot be used.
using MapByName = std::function<PlacedField(const std::string& name)>;

/// Searches the maps that the index ranks first, one after the other. `down_sensor`: unit vector; down in the
/// atlas is -z. `progress` returns false to cancel. Never throws for bad points.
AtlasLocation locateInAtlas(const PlaceIndex& index, const MapByName& maps, const ScanPoints& points,
                            const Eigen::Vector3d& down_sensor, const AtlasSearchOptions& options = {},
                            const ProgressCallback& progress = {});

}  // namespace ttsdf
