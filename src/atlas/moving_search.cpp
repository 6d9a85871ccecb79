#include "ttsdf_localization/atlas/moving_search.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "atlas_members.h"

namespace ttsdf {

namespace {

constexpr double kSame = 0.3, kSameTurn = 0.15;           // one place [m], [rad]
constexpr double kStartSigma = 0.15, kStartTurn = 0.07;   // of a pose of the index [m], [rad]
constexpr double kLeastSigma = 0.02, kLeastTurn = 0.015;  // of odometry over a short way [m], [rad]
constexpr double kWorstScore = 0.6;  // a scan that somebody stands before refutes no place alone
constexpr double kWorse = 0.1;       // a new place that explains the newest scan worse by this is none
constexpr std::size_t kNamed = 16;   // candidates of an answer

Matrix6d covarianceOf(double translation, double rotation) {
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal().head<3>().setConstant(rotation * rotation);
  covariance.diagonal().tail<3>().setConstant(translation * translation);
  return covariance;
}

bool samePlace(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const PoseError apart = poseError(a, b);
  return apart.translation < kSame && apart.rotation < kSameTurn;
}

}  // namespace

RegistrationOptions MovingSearchOptions::quickRegistration() {
  RegistrationOptions quick;
  quick.max_points = 300;
  quick.max_iterations = 10;
  quick.restarts = 0;
  return quick;
}

void check(const MovingSearchOptions& options) {
  const auto wanted = [](const char* name, bool good, double value, const char* range) {
    if (good) return;
    throw std::invalid_argument(std::string("moving search: ") + name + ": got " + std::to_string(value) +
                                ", wanted " + range);
  };
  for (const auto& [name, value] :
       {std::pair("starts", options.starts), std::pair("later_starts", options.later_starts),
        std::pair("followed", options.followed), std::pair("scans", options.scans),
        std::pair("min_scans", options.min_scans)}) {
    wanted(name, value >= 1, value, "1 or more");
  }
  for (const auto& [name, value] : {std::pair("step", options.step), std::pair("turn", options.turn),
                                    std::pair("max_score", options.max_score),
                                    std::pair("lead", options.lead), std::pair("drift", options.drift)}) {
    wanted(name, std::isfinite(value) && value > 0.0, value, "a number above 0");
  }
  wanted("refuted", std::isfinite(options.refuted) && options.refuted >= options.lead, options.refuted,
         "at least lead");
}

double MovingSearch::Place::sum() const { return std::accumulate(scores.begin(), scores.end(), 0.0); }

/// A map and those that overlap with it, ready to be registered in.
class MovingSearch::Area {
 public:
  Area(std::vector<PlacedField> around, const RegistrationOptions& options)
      : field_(std::make_shared<const AtlasField>(std::move(around))),
        registration_(field_, options, field_->farField()) {}

  /// Moves a place to where it explains the scan best, and says how well that is.
  double align(const ScanPoints& points, const Matrix6d& covariance, Place& place) {
    place.result = registration_.align(points, place.T_atlas_sensor, covariance);
    place.T_atlas_sensor = place.result.T_map_sensor;
    place.map = field_->maps()[deepestOf(field_->maps(), place.T_atlas_sensor.translation())].name;
    return std::min(kWorstScore, place.result.score + place.result.blocked_ratio);
  }

 private:
  std::shared_ptr<const AtlasField> field_;
  Registration registration_;
};

MovingSearch::MovingSearch(const MovingSearchOptions& options) : options_((check(options), options)) {}

void MovingSearch::clear() {
  scans_.clear();
  places_.clear();
  count_ = 0;
  answer_ = AtlasLocation();
}

bool MovingSearch::moved(const Eigen::Isometry3d& T_odom_sensor) const {
  if (scans_.empty()) return true;
  const PoseError way = poseError(scans_.back().T_odom_sensor, T_odom_sensor);
  return way.translation >= options_.step || way.rotation >= options_.turn;
}

/// The places, moved as the odometry says.
std::vector<MovingSearch::Place> MovingSearch::predicted(const Eigen::Isometry3d& T_odom_sensor) const {
  std::vector<Place> places = places_;
  for (Place& place : places)
    place.T_atlas_sensor = place.T_atlas_sensor * scans_.back().T_odom_sensor.inverse() * T_odom_sensor;
  return places;
}

/// Poses of the index that are none of the known places, the most alike first, each place once.
std::vector<MovingSearch::Place> MovingSearch::startsOf(const SearchedAtlas& where, const Scan& scan,
                                                        const Eigen::Vector3d& down_sensor,
                                                        const std::vector<Place>& known) const {
  const int most = count_ < options_.min_scans ? options_.starts : options_.later_starts;
  std::vector<Place> starts;
  for (const PlaceIndex::Hypothesis& one : where.index.hypotheses(scan.points, down_sensor)) {
    if (starts.size() == static_cast<std::size_t>(most)) break;
    const AtlasMap* const map = where.atlas.find(one.map);
    if (!map) continue;
    Place start;
    start.map = one.map;
    start.T_atlas_sensor = one.poseIn(map->box());
    const auto same = [&](const Place& other) {
      return samePlace(start.T_atlas_sensor, other.T_atlas_sensor);
    };
    if (std::any_of(known.begin(), known.end(), same) || std::any_of(starts.begin(), starts.end(), same))
      continue;
    starts.push_back(std::move(start));
  }
  return starts;
}

/// What odometry is off by over a way.
Matrix6d MovingSearch::driftOver(const Eigen::Isometry3d& T_before_after) const {
  const double way = options_.drift * T_before_after.translation().norm();
  return covarianceOf(kLeastSigma + way, kLeastTurn + way);
}

/// What a place that the newest scan showed makes of the scans before, until they refute it.
void MovingSearch::lookBack(Area& area, const Scan& newest, Place& place) const {
  Place before = place;
  double lead = 0.0;
  const Scan* after = &newest;
  for (std::size_t n = scans_.size(); n-- > 0; after = &scans_[n + 1]) {
    const Eigen::Isometry3d T_after_before = after->T_odom_sensor.inverse() * scans_[n].T_odom_sensor;
    before.T_atlas_sensor = before.T_atlas_sensor * T_after_before;
    place.scores.insert(place.scores.begin(),
                        area.align(scans_[n].points, driftOver(T_after_before), before));
    if (!places_.empty()) lead += place.scores.front() - places_.front().scores[n];
    if (lead > options_.refuted) return;
  }
}

/// Calls `use` for every place, those of one map together. False: cancelled.
bool MovingSearch::inTheirMaps(const SearchedAtlas& where, std::vector<Place>& places,
                               const ProgressCallback& progress,
                               const std::function<void(Area& area, Place& place)>& use) {
  std::map<std::string, std::vector<Place*>> in_map;
  for (Place& place : places) in_map[place.map].push_back(&place);
  double done = 0.0;
  for (const auto& [map, here] : in_map) {
    if (progress && !progress(done++ / static_cast<double>(in_map.size()))) return false;
    std::vector<PlacedField> around = where.maps(map);
    all_read_ = all_read_ && !around.empty();
    if (around.empty()) continue;
    Area area(std::move(around), options_.registration);
    for (Place* const place : here) use(area, *place);
  }
  return true;
}

AtlasLocation MovingSearch::add(const SearchedAtlas& where, const ScanPoints& points,
                                const Eigen::Vector3d& down_sensor, const Eigen::Isometry3d& T_odom_sensor,
                                const ProgressCallback& progress) {
  if (!T_odom_sensor.matrix().allFinite() || !moved(T_odom_sensor)) return answer_;
  AtlasLocation nothing;
  nothing.reason = TerminationReason::kTooFewPoints;
  if (points.array().isFinite().colwise().all().count() < options_.registration.min_points) return nothing;
  const auto share = [&progress](double from, double to) {
    return [&progress, from, to](double done) { return !progress || progress(from + (to - from) * done); };
  };
  nothing.reason = TerminationReason::kCancelled;

  const Scan scan{points, T_odom_sensor};
  std::vector<Place> known = predicted(T_odom_sensor);
  std::vector<Place> starts = startsOf(where, scan, down_sensor, known);
  const Matrix6d of_odometry =
                     driftOver(scans_.empty() ? Eigen::Isometry3d::Identity()
                                              : scans_.back().T_odom_sensor.inverse() * T_odom_sensor),
                 of_index = covarianceOf(kStartSigma, kStartTurn);
  all_read_ = true;
  double best = kWorstScore;
  const auto compare = [&](const Matrix6d& covariance) {
    return [&](Area& area, Place& place) {
      place.scores.push_back(area.align(points, covariance, place));
      best = std::min(best, place.scores.back());
    };
  };
  if (!inTheirMaps(where, known, share(0.0, 0.3), compare(of_odometry)) ||
      !inTheirMaps(where, starts, share(0.3, 0.6), compare(of_index)))
    return nothing;
  const auto refuted = [&](const Place& place) {
    return place.scores.empty() || place.scores.back() > best + kWorse;
  };
  starts.erase(std::remove_if(starts.begin(), starts.end(), refuted), starts.end());
  if (!inTheirMaps(where, starts, share(0.6, 1.0),
                   [&](Area& area, Place& place) { lookBack(area, scan, place); }))
    return nothing;
  known.insert(known.end(), std::make_move_iterator(starts.begin()), std::make_move_iterator(starts.end()));
  scans_.push_back(scan);
  ++count_;
  keep(std::move(known));
  answer_ = decide();
  return answer_;
}

/// Sorts the places, each once, without those that are refuted.
void MovingSearch::keep(std::vector<Place> places) {
  const auto refuted = [&](const Place& place) { return place.scores.size() < scans_.size(); };
  places.erase(std::remove_if(places.begin(), places.end(), refuted), places.end());
  const auto window = static_cast<std::size_t>(options_.scans);
  if (scans_.size() > window) scans_.erase(scans_.begin());
  for (Place& place : places) {
    if (place.scores.size() > window) place.scores.erase(place.scores.begin());
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& a, const Place& b) { return a.sum() < b.sum(); });
  places_.clear();
  for (Place& place : places) {
    if (places_.size() == static_cast<std::size_t>(options_.followed)) return;
    if (!places_.empty() && place.sum() > places_.front().sum() + options_.refuted) return;
    const bool known = std::any_of(places_.begin(), places_.end(), [&](const Place& other) {
      return samePlace(place.T_atlas_sensor, other.T_atlas_sensor);
    });
    if (!known) places_.push_back(std::move(place));
  }
}

AtlasLocation MovingSearch::decide() const {
  AtlasLocation location;
  for (std::size_t n = 0; n < std::min(kNamed, places_.size()); ++n) {
    AtlasCandidate candidate;
    candidate.map = places_[n].map;
    candidate.T_atlas_sensor = places_[n].T_atlas_sensor;
    candidate.result = places_[n].result;
    candidate.mean = places_[n].sum() / static_cast<double>(places_[n].scores.size());
    location.candidates.push_back(std::move(candidate));
  }
  if (places_.empty()) return location;
  const Place& best = places_.front();
  const bool shows = best.result.success && best.scores.back() <= options_.max_score;  // in the newest scan
  if (best.sum() > options_.max_score * static_cast<double>(best.scores.size())) {
    location.reason = TerminationReason::kLowScore;
  } else if (places_.size() > 1 && places_[1].sum() - best.sum() < options_.lead) {
    location.reason = TerminationReason::kAmbiguous;
  } else if (count_ < options_.min_scans || !shows || !all_read_) {
    location.reason = TerminationReason::kUnsure;
  } else {
    location.reason = TerminationReason::kConverged;
    location.success = true;
  }
  return location;
}

}  // namespace ttsdf
