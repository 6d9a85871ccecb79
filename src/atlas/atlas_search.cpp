#include "ttsdf_localization/atlas/atlas_search.h"

#include <algorithm>
#include <memory>

#include "atlas_members.h"
#include "search_window.h"

namespace ttsdf {

namespace {

constexpr double kIndexShare = 0.3;  // of the progress, where maps may have to be searched, too

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

/// The best pose of an area, and the runner-up if that is a twin.
void addFound(const SearchArea& area, RegistrationResult result, std::vector<AtlasCandidate>& found) {
  const auto mapAt = [&](const Eigen::Isometry3d& T) {
    return area.maps[deepestOf(area.maps, T.translation())].name;
  };
  AtlasCandidate best;
  best.result = std::move(result);
  best.T_atlas_sensor = best.result.T_map_sensor;
  best.map = mapAt(best.T_atlas_sensor);
  found.push_back(best);
  if (best.result.reason != TerminationReason::kAmbiguous) return;
  AtlasCandidate other = best;
  other.T_atlas_sensor = other.result.T_map_sensor = best.result.T_map_runner_up;
  other.map = mapAt(other.T_atlas_sensor);
  other.result.score = best.result.runner_up_score;
  other.result.blocked_ratio = 0.0;  // it is in the runner-up's score
  found.push_back(other);
}

/// Starts everywhere in an area.
void searchArea(const SearchArea& area, const ScanPoints& points,
                const std::optional<Eigen::Vector3d>& down_sensor, const AtlasSearchOptions& options,
                const ProgressCallback& progress, std::vector<AtlasCandidate>& found) {
  const auto field = std::make_shared<const AtlasField>(area.maps);
  Registration registration(std::make_shared<const SearchWindow>(field, area.searched), options.registration,
                            field->farField());
  addFound(area,
           localizeGlobally(registration, points, down_sensor, -Eigen::Vector3d::UnitZ(), options.global,
                            progress),
           found);
}

bool samePlace(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double distance, double angle) {
  const PoseError apart = poseError(a, b);
  return apart.translation < distance && apart.rotation < angle;
}

/// A pose of the index, and how much the scan differs from what is seen there.
struct Start {
  Eigen::Isometry3d T_atlas_sensor;
  double difference;
};

/// Poses of the index in the maps that an area searches, the most alike first, each place once.
std::vector<Start> startsIn(const SearchArea& area, const std::vector<PlaceIndex::Hypothesis>& hypotheses,
                            std::size_t most) {
  constexpr double kSame = 0.2, kSameTurn = 0.1;  // [m], [rad]
  std::vector<Start> starts;
  for (std::size_t n = 0; n < most; ++n) {
    const auto map =
        std::find_if(area.maps.begin(), area.maps.begin() + static_cast<std::ptrdiff_t>(area.searched),
                     [&](const PlacedField& one) { return one.name == hypotheses[n].map; });
    if (map == area.maps.begin() + static_cast<std::ptrdiff_t>(area.searched)) continue;
    const Eigen::Isometry3d T = hypotheses[n].poseIn(boxInAtlas(*map));
    const bool known = std::any_of(starts.begin(), starts.end(), [&](const Start& other) {
      return samePlace(T, other.T_atlas_sensor, kSame, kSameTurn);
    });
    if (!known) starts.push_back({T, hypotheses[n].difference});
  }
  return starts;
}

/// What global localization in one map asks of its answer.
void applyThresholds(const GlobalOptions& options, RegistrationResult& best) {
  if (!best.success) return;
  const double score = best.score + best.blocked_ratio;
  best.success = false;
  if (score > options.max_score) {
    best.reason = TerminationReason::kLowScore;
  } else if (best.confidence < options.min_confidence) {
    best.reason = TerminationReason::kUnsure;
  } else if (best.runner_up_score - score < options.min_margin) {
    best.reason = TerminationReason::kAmbiguous;
  } else {
    best.success = true;
  }
}

/// Overlapping maps find the same place: its best explanation stays.
std::vector<AtlasCandidate> distinct(std::vector<AtlasCandidate> found, double same_place) {
  std::stable_sort(found.begin(), found.end(),
                   [](const AtlasCandidate& a, const AtlasCandidate& b) { return a.score() < b.score(); });
  std::vector<AtlasCandidate> kept;
  for (AtlasCandidate& candidate : found) {
    const bool known = std::any_of(kept.begin(), kept.end(), [&](const AtlasCandidate& other) {
      return samePlace(candidate.T_atlas_sensor, other.T_atlas_sensor, same_place, 0.5);
    });
    if (!known) kept.push_back(std::move(candidate));
  }
  return kept;
}

}  // namespace

namespace {

/// What the candidates of all maps say together: a map's own answer knows nothing of its twins elsewhere.
/// `all_searched`: no map was left out that may hold the scan.
void decideLocation(const AtlasSearchOptions& options, bool all_searched, AtlasLocation& location) {
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

/// What registering the scan from the poses of the index says.
struct IndexSearch {
  std::vector<AtlasCandidate> found;
  std::vector<Start> starts;
  double left_out = 1.0;  ///< least difference of what was not tried
  bool complete = true;   ///< every map could be used
  bool cancelled = false;

  /// No pose that was left out looks as alike as the place at T.
  bool covers(const Eigen::Isometry3d& T) const {
    constexpr double kMargin = 0.05;  // a place may look worse than its twin by this, a metre between places
    constexpr double kNear = 0.6, kNearTurn = 0.3;  // [m], [rad]
    double here = 1.0;
    for (const Start& start : starts) {
      if (samePlace(T, start.T_atlas_sensor, kNear, kNearTurn)) here = std::min(here, start.difference);
    }
    return here + kMargin <= left_out;
  }
};

IndexSearch searchFromIndex(const PlaceIndex& index, const MapsAround& maps, const ScanPoints& points,
                            const Eigen::Vector3d& down, const AtlasSearchOptions& options,
                            const ProgressCallback& progress) {
  IndexSearch search;
  const auto hypotheses = index.hypotheses(points, down);
  const std::size_t most =
      std::min(hypotheses.size(), static_cast<std::size_t>(std::max(1, options.hypotheses)));
  if (most < hypotheses.size()) search.left_out = hypotheses[most].difference;
  std::vector<std::string> names;
  for (std::size_t n = 0; n < most; ++n) {
    if (std::find(names.begin(), names.end(), hypotheses[n].map) == names.end())
      names.push_back(hypotheses[n].map);
  }
  const auto count = static_cast<double>(names.size());
  const auto goesOn = [&] {
    return !progress || progress(1.0 - static_cast<double>(names.size()) / std::max(1.0, count));
  };
  for (search.cancelled = !goesOn(); !names.empty() && !search.cancelled; search.cancelled = !goesOn()) {
    const SearchArea area = takeArea(names, maps, options.maps_at_once);
    search.complete = search.complete && area.searched > 0;
    const std::vector<Start> starts = startsIn(area, hypotheses, most);
    if (starts.empty()) continue;
    const auto field = std::make_shared<const AtlasField>(area.maps);
    Registration registration(field, options.registration, field->farField());
    std::vector<Eigen::Isometry3d> poses;
    for (const Start& start : starts) poses.push_back(start.T_atlas_sensor);
    RegistrationResult result =
        registration.alignFrom(points, poses, PosePrior{poses.front(), Matrix6d::Zero()});
    applyThresholds(options.global, result);
    addFound(area, std::move(result), search.found);
    search.starts.insert(search.starts.end(), starts.begin(), starts.end());
  }
  return search;
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
  double begins = 0.0;
  if (down_sensor) {
    begins = plan.complete ? kIndexShare : 1.0;
    IndexSearch search = searchFromIndex(index, maps, points, *down_sensor, options,
                                         [&](double done) { return !progress || progress(begins * done); });
    found = search.found;
    location.candidates = distinct(std::move(search.found), options.same_place);
    if (search.cancelled) {
      location.reason = TerminationReason::kCancelled;
      return location;
    }
    if (!location.candidates.empty()) {
      const bool covered = search.complete && unknown.empty() &&
                           location.candidates.front().score() <= options.sure_score &&
                           search.covers(location.candidates.front().T_atlas_sensor);
      decideLocation(options, covered, location);
    }
    // Twins that explain the scan badly say little: the right place may not have been tried.
    const bool twins = location.reason == TerminationReason::kAmbiguous &&
                       location.candidates.front().score() <= options.sure_score;
    if (location.success || twins || !plan.complete) return location;
    location = AtlasLocation();
  }
  while (!names.empty() && !cancelled) {
    const double before = count - static_cast<double>(names.size());
    const SearchArea area = takeArea(names, maps, options.maps_at_once);
    if (area.searched == 0) {
      plan.complete = false;
      continue;
    }
    const ProgressCallback share = [&](double done) {
      const double sum = before + done * static_cast<double>(area.searched);
      if (progress && !progress(begins + (1.0 - begins) * sum / count)) cancelled = true;
      return !cancelled;
    };
    searchArea(area, points, down_sensor, options, share, found);
  }
  location.candidates = distinct(std::move(found), options.same_place);
  if (cancelled) {
    location.reason = TerminationReason::kCancelled;
  } else if (!location.candidates.empty()) {
    decideLocation(options, plan.complete, location);
  }
  return location;
}

}  // namespace ttsdf
