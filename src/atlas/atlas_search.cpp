#include "ttsdf_localization/atlas/atlas_search.h"

#include <algorithm>

namespace ttsdf {

namespace {

/// The best pose of one map, and the runner-up if that map has a twin place in itself.
void searchMap(const PlacedField& map, const ScanPoints& points, const Eigen::Vector3d& down_sensor,
               const AtlasSearchOptions& options, const ProgressCallback& progress,
               std::vector<AtlasCandidate>& found) {
  Registration registration(map.field, options.registration, map.far);
  const Eigen::Vector3d map_down = map.T_atlas_map.linear().transpose() * -Eigen::Vector3d::UnitZ();
  AtlasCandidate best;
  best.map = map.name;
  best.result = localizeGlobally(registration, points, down_sensor, map_down, options.global, progress);
  best.T_atlas_sensor = map.T_atlas_map * best.result.T_map_sensor;
  found.push_back(best);
  if (best.result.reason != TerminationReason::kAmbiguous) return;
  AtlasCandidate other = best;
  other.result.T_map_sensor = best.result.T_map_runner_up;
  other.result.score = best.result.runner_up_score;
  other.result.blocked_ratio = 0.0;  // it is in the runner-up's score
  other.T_atlas_sensor = map.T_atlas_map * best.result.T_map_runner_up;
  found.push_back(other);
}

/// Overlapping maps find the same place: its best explanation stays.
std::vector<AtlasCandidate> distinct(std::vector<AtlasCandidate> found, double same_place) {
  std::stable_sort(found.begin(), found.end(),
                   [](const AtlasCandidate& a, const AtlasCandidate& b) { return a.score() < b.score(); });
  std::vector<AtlasCandidate> kept;
  for (AtlasCandidate& candidate : found) {
    const bool known = std::any_of(kept.begin(), kept.end(), [&](const AtlasCandidate& other) {
      return poseError(candidate.T_atlas_sensor, other.T_atlas_sensor).translation < same_place &&
             poseError(candidate.T_atlas_sensor, other.T_atlas_sensor).rotation < 0.5;
    });
    if (!known) kept.push_back(std::move(candidate));
  }
  return kept;
}

}  // namespace

AtlasLocation locateInAtlas(const PlaceIndex& index, const MapByName& maps, const ScanPoints& points,
                            const Eigen::Vector3d& down_sensor, const AtlasSearchOptions& options,
                            const ProgressCallback& progress) {
  AtlasLocation location;
  const auto ranked = index.rank(points, down_sensor);
  const std::size_t count = std::min(ranked.size(), static_cast<std::size_t>(std::max(1, options.max_maps)));
  std::vector<AtlasCandidate> found;
  bool cancelled = false;
  for (std::size_t n = 0; n < count && !cancelled; ++n) {
    const PlacedField map = maps(ranked[n].map);
    if (!map.field) continue;
    const ProgressCallback share = [&](double done) {
      if (progress && !progress((static_cast<double>(n) + done) / static_cast<double>(count)))
        cancelled = true;
      return !cancelled;
    };
    searchMap(map, points, down_sensor, options, share, found);
  }
  location.candidates = distinct(std::move(found), options.same_place);
  if (cancelled) {
    location.reason = TerminationReason::kCancelled;
  } else if (!location.candidates.empty()) {
    const auto& list = location.candidates;
    location.reason = list[0].result.reason;
    // A map's own answer knows nothing of its twins elsewhere.
    const bool good = list[0].result.success || list[0].result.reason == TerminationReason::kAmbiguous;
    const bool alike = list.size() > 1 && list[1].score() - list[0].score() < options.min_margin;
    if (good) location.reason = alike ? TerminationReason::kAmbiguous : TerminationReason::kConverged;
    location.success = good && !alike && list[0].result.success;
    if (good && !alike && !location.success) location.reason = list[0].result.reason;
    if (location.success && list[0].score() > options.max_score) {
      location.reason = TerminationReason::kLowScore;
      location.success = false;
    }
    if (location.success && count < ranked.size() && ranked[count].difference < options.excluded_difference) {
      location.reason = TerminationReason::kUnsure;
      location.success = false;
    }
  }
  return location;
}

}  // namespace ttsdf
