#pragma once
// Which map am I in, and where: global localization over an atlas.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "ttsdf_localization/atlas/place_index.h"
#include "ttsdf_localization/registration/search.h"

namespace ttsdf {

struct AtlasSearchOptions {
  int max_maps = 16;      ///< maps that are searched at the most, in the order of the index
  int maps_at_once = 8;   ///< neighbours among them are searched together, at most so many
  int hypotheses = 1000;  ///< poses of the index that are registered before any map is searched
  /// A worse best score of these is not accepted: the right place may not be among them.
  double sure_score = 0.15;
  double same_place = 0.5;  ///< poses of two maps this near to each other are one answer [m]
  /// Maps that differ more from the scan (index) need not be searched. Where max_maps ends before that, or a
  /// map cannot be used, nothing is accepted (kUnsure): a map that fits may not be the only one.
  double excluded_difference = 0.35;
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
  RegistrationResult result;  ///< in the atlas' frame
  double mean = 1.0;          ///< score() of all scans that were compared, one by one (MovingSearch)
  double score() const { return result.score + result.blocked_ratio; }
};

struct AtlasLocation {
  /// kConverged: the first candidate is the pose. kAmbiguous: the candidates look alike, motion must decide.
  /// kLowScore, kUnsure, kTooFewPoints, kCancelled: as of global localization in the best map.
  TerminationReason reason = TerminationReason::kLowScore;
  bool success = false;
  std::vector<AtlasCandidate> candidates;  ///< distinct places, the best first
};

/// Gives a map by its name and those that overlap with it, itself first, loaded or in memory; empty: it
/// cannot be used.
using MapsAround = std::function<std::vector<PlacedField>(const std::string& name)>;

/// Registers the scan from the poses that the index finds most alike, whatever the number of maps. Where that
/// does not settle it, searches the maps that the index ranks first, if these are all that may hold the scan:
/// starts in these maps, scans compared with their neighbours, too. Of three and more twins in maps that are
/// searched at once two are named. `down_sensor`: unit vector; down in the atlas is -z. Without it the index
/// says nothing: maps are searched in its order. `unknown`: maps that it does not hold; each may hold the
/// scan. `progress` returns false to cancel. Never throws for bad points.
AtlasLocation locateInAtlas(const PlaceIndex& index, const MapsAround& maps, const ScanPoints& points,
                            const std::optional<Eigen::Vector3d>& down_sensor,
                            const AtlasSearchOptions& options = {}, const ProgressCallback& progress = {},
                            const std::vector<std::string>& unknown = {});

}  // namespace ttsdf
