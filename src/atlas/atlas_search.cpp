#include "ttsdf_localization/atlas/atlas_search.h"

#include <algorithm>
#include <memory>

#include "atlas_members.h"
#include "search_window.h"

namespace ttsdf {

namespace {

/// Maps that are searched at once, and those around them.
struct SearchArea {
  std::vector<PlacedField> maps;  ///< those that are searched first
  std::size_t searched = 0;
};

bool holds(const std::vector<PlacedField>& maps, const std::string& name) {
  return std::any_of(maps.begin(), maps.end(), [&](const PlacedField& map) { return map.name == name; });
}

/// Takes the first of `names` and as many of its neighbours among them as may be searched with it. Nothing is
/// searched if the first one cannot be used.
SearchArea takeArea(std::vector<std::string>& names, const MapsAround& maps, int most) {
  SearchArea area;
  std::vector<PlacedField> beside;
  std::vector<std::string> next{names.front()};
  for (std::size_t n = 0; n < next.size() && n < static_cast<std::size_t>(std::max(1, most)); ++n) {
    const std::vector<PlacedField> around = maps(next[n]);
    if (around.empty() && n > 0) continue;  // comes again as the first one
    names.erase(std::find(names.begin(), names.end(), next[n]));
    if (around.empty()) return area;
    area.maps.push_back(around.front());
    for (std::size_t k = 1; k < around.size(); ++k) {
      const std::string& name = around[k].name;
      if (!holds(beside, name)) beside.push_back(around[k]);
      const bool wanted = std::find(names.begin(), names.end(), name) != names.end();
      if (wanted && std::find(next.begin(), next.end(), name) == next.end()) next.push_back(name);
    }
  }
  area.searched = area.maps.size();
  for (PlacedField& map : beside) {
    if (!holds(area.maps, map.name)) area.maps.push_back(std::move(map));
  }
  return area;
}

/// The best pose that starts in an area lead to, and the runner-up if that is a twin.
void searchArea(const SearchArea& area, const ScanPoints& points,
                const std::optional<Eigen::Vector3d>& down_sensor, const AtlasSearchOptions& options,
                const ProgressCallback& progress, std::vector<AtlasCandidate>& found) {
  const auto field = std::make_shared<const AtlasField>(area.maps);
  Registration registration(std::make_shared<const SearchWindow>(field, area.searched), options.registration,
                            field->farField());
  AtlasCandidate best;
  best.result = localizeGlobally(registration, points, down_sensor, -Eigen::Vector3d::UnitZ(), options.global,
                                 progress);
  best.T_atlas_sensor = best.result.T_map_sensor;
  best.map = area.maps[deepestOf(area.maps, best.T_atlas_sensor.translation())].name;
  found.push_back(best);
  if (best.result.reason != TerminationReason::kAmbiguous) return;
  AtlasCandidate other = best;
  other.T_atlas_sensor = other.result.T_map_sensor = best.result.T_map_runner_up;
  other.map = area.maps[deepestOf(area.maps, other.T_atlas_sensor.translation())].name;
  other.result.score = best.result.runner_up_score;
  other.result.blocked_ratio = 0.0;  // it is in the runner-up's score
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

namespace {

/// What the candidates of all maps say together: a map's own answer knows nothing of its twins elsewhere.
/// `all_searched`: no map was left out that may hold the scan.
void settleLocation(const AtlasSearchOptions& options, bool all_searched, AtlasLocation& location) {
  const auto& list = location.candidates;
  const RegistrationResult& best = list[0].result;
  const bool alike = list.size() > 1 && list[1].score() - list[0].score() < options.min_margin;
  location.reason = best.reason;
  if (!best.success) return;
  if (list[0].score() > options.max_score) {
    location.reason = TerminationReason::kLowScore;
  } else if (alike) {
    location.reason = TerminationReason::kAmbiguous;
  } else if (!all_searched) {
    location.reason = TerminationReason::kUnsure;
  } else {
    location.reason = TerminationReason::kConverged;
    location.success = true;
  }
}

/// Maps to be searched, and whether these are all that may hold the scan.
struct SearchPlan {
  std::vector<std::string> names;
  bool complete = true;
};

SearchPlan planOf(const PlaceIndex& index, const ScanPoints& points,
                  const std::optional<Eigen::Vector3d>& down, const AtlasSearchOptions& options,
                  const std::vector<std::string>& unknown) {
  SearchPlan plan;
  const auto add = [&](const std::string& name) {
    if (plan.names.size() < static_cast<std::size_t>(std::max(1, options.max_maps))) {
      plan.names.push_back(name);
    } else {
      plan.complete = false;
    }
  };
  if (!down) {
    for (const PlaceIndex::Entry& map : index.maps()) add(map.name);
  } else {
    for (const PlaceIndex::Ranked& one : index.rank(points, *down)) {
      if (!plan.names.empty() && one.difference >= options.excluded_difference) break;
      add(one.map);
    }
  }
  for (const std::string& name : unknown) add(name);
  return plan;
}

}  // namespace

AtlasLocation locateInAtlas(const PlaceIndex& index, const MapsAround& maps, const ScanPoints& points,
                            const std::optional<Eigen::Vector3d>& down_sensor,
                            const AtlasSearchOptions& options, const ProgressCallback& progress,
                            const std::vector<std::string>& unknown) {
  AtlasLocation location;
  SearchPlan plan = planOf(index, points, down_sensor, options, unknown);
  std::vector<std::string>& names = plan.names;
  const auto count = static_cast<double>(names.size());
  std::vector<AtlasCandidate> found;
  bool cancelled = false;
  while (!names.empty() && !cancelled) {
    const double before = count - static_cast<double>(names.size());
    const SearchArea area = takeArea(names, maps, options.maps_at_once);
    if (area.searched == 0) {
      plan.complete = false;
      continue;
    }
    const ProgressCallback share = [&](double done) {
      const double sum = before + done * static_cast<double>(area.searched);
      if (progress && !progress(sum / count)) cancelled = true;
      return !cancelled;
    };
    searchArea(area, points, down_sensor, options, share, found);
  }
  location.candidates = distinct(std::move(found), options.same_place);
  if (cancelled) {
    location.reason = TerminationReason::kCancelled;
  } else if (!location.candidates.empty()) {
    settleLocation(options, plan.complete, location);
  }
  return location;
}

}  // namespace ttsdf
