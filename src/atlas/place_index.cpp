#include "ttsdf_localization/atlas/place_index.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "atlas_members.h"
#include "scan_views.h"

namespace ttsdf {

namespace {

/// Ranges from one point, by rays that leap as far as the far field lets them.
PlaceRanges lookAround(const DistanceField& field, const DistanceField& far_field,
                       const Eigen::Vector3f& from) {
  constexpr int kRays = kPlaceAzimuths * kPlaceElevations, kMostSteps = 200;
  const auto voxel = static_cast<float>(field.geometry().voxel_size);
  const float blur = 0.75F * static_cast<float>(far_field.geometry().voxel_size);
  std::vector<Eigen::Vector3f> directions;
  for (const double elevation : kPlaceRows) {
    for (int a = 0; a < kPlaceAzimuths; ++a) {
      const double azimuth = 2.0 * M_PI * (a + 0.5) / kPlaceAzimuths;
      directions.push_back(Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                                           std::cos(elevation) * std::sin(azimuth), std::sin(elevation))
                               .cast<float>());
    }
  }
  PlaceRanges ranges;
  ranges.fill(kNoRange);
  std::vector<float> at(kRays, 0.0F);
  std::vector<int> going(kRays);
  for (int n = 0; n < kRays; ++n) going[static_cast<std::size_t>(n)] = n;
  for (int step = 0; step < kMostSteps && !going.empty(); ++step) {
    Eigen::Matrix3Xf points(3, static_cast<Eigen::Index>(going.size()));
    for (std::size_t k = 0; k < going.size(); ++k) {
      const auto n = static_cast<std::size_t>(going[k]);
      points.col(static_cast<Eigen::Index>(k)) = from + at[n] * directions[n];
    }
    const FieldSamples near = field.evaluate(points), far = far_field.evaluate(points);
    std::vector<int> still;
    for (std::size_t k = 0; k < going.size(); ++k) {
      const auto n = static_cast<std::size_t>(going[k]);
      const auto column = static_cast<Eigen::Index>(k);
      if (near.states[k] == PointState::kOutside) continue;
      if (near.states[k] == PointState::kValid && near.values[column] < 0.25F * voxel) {
        ranges[n] = placeRange(static_cast<double>(at[n]));
        continue;
      }
      const float free = std::max(near.states[k] == PointState::kValid ? near.values[column] : 0.0F,
                                  std::abs(far.values[column]) - blur);
      at[n] += std::max(free, 0.5F * voxel);
      if (at[n] < static_cast<float>(kFarthestPlaceRange)) still.push_back(going[k]);
    }
    going = std::move(still);
  }
  return ranges;
}

}  // namespace

std::array<std::uint16_t, 3> IndexedPlace::stepsOf(const Eigen::Vector3d& in_box) {
  std::array<std::uint16_t, 3> steps{};
  for (std::size_t d = 0; d < 3; ++d) {
    const double count = std::round(in_box[static_cast<Eigen::Index>(d)] / kStep);
    steps[d] = static_cast<std::uint16_t>(std::clamp(count, 0.0, 65535.0));
  }
  return steps;
}

void PlaceIndex::add(const std::vector<PlacedField>& around, std::uint32_t key) {
  const std::string name = around.empty() ? "" : around.front().name;
  if (around.empty() || std::any_of(around.begin(), around.end(),
                                    [](const PlacedField& map) { return !map.field || !map.far; })) {
    throw std::invalid_argument("place index: map '" + name + "': got no far field, wanted one of each map");
  }
  const AtlasField field(around);
  const auto far_field = field.farField();
  const OrientedBox box = boxInAtlas(around.front());
  const Eigen::Array3i count = (box.size / options_.spacing).array().ceil().max(1.0).cast<int>();
  std::vector<Eigen::Vector3f> points;
  std::vector<std::array<std::uint16_t, 3>> in_box;
  for (int k = 0; k < count[2]; ++k) {
    for (int j = 0; j < count[1]; ++j) {
      for (int i = 0; i < count[0]; ++i) {
        const Eigen::Vector3d share = (Eigen::Array3d(i, j, k) + 0.5) / count.cast<double>();
        const Eigen::Vector3d p = box.T_atlas_box * box.size.cwiseProduct(share);
        if (deepestOf(around, p) != 0) continue;
        points.push_back((p - field.geometry().origin).cast<float>());
        in_box.push_back(IndexedPlace::stepsOf(box.size.cwiseProduct(share)));
      }
    }
  }
  Entry entry{name, key, {}};
  if (!points.empty()) {
    const Eigen::Map<const Eigen::Matrix3Xf> matrix(points.front().data(), 3,
                                                    static_cast<Eigen::Index>(points.size()));
    const FieldSamples near = field.evaluate(Eigen::Matrix3Xf(matrix)),
                       far = far_field->evaluate(Eigen::Matrix3Xf(matrix));
    for (std::size_t n = 0; n < points.size(); ++n) {
      if (near.states[n] != PointState::kValid) continue;
      if (far.values[static_cast<Eigen::Index>(n)] < static_cast<float>(options_.clearance)) continue;
      entry.places.push_back({lookAround(field, *far_field, points[n]), in_box[n]});
    }
  }
  put(std::move(entry));
}

void PlaceIndex::put(Entry map) {
  const auto same =
      std::find_if(maps_.begin(), maps_.end(), [&map](const Entry& entry) { return entry.name == map.name; });
  if (same == maps_.end()) {
    maps_.push_back(std::move(map));
  } else {
    *same = std::move(map);
  }
}

const PlaceIndex::Entry* PlaceIndex::find(const std::string& name) const {
  const auto found =
      std::find_if(maps_.begin(), maps_.end(), [&name](const Entry& entry) { return entry.name == name; });
  return found == maps_.end() ? nullptr : &*found;
}

namespace {

double leastDifference(const std::vector<ScanView>& views, const PlaceRanges& place, double best) {
  const WidePlace wide(place);
  for (const ScanView& view : views) best = view.seen.difference(wide, best);
  return best;
}

struct Compared {
  double difference;
  std::size_t map, place;
};

/// All places by a few views of the scan, the most alike first.
std::vector<Compared> compareAll(const std::vector<PlaceIndex::Entry>& maps, const ScanViews& views) {
  std::vector<Compared> compared;
  for (std::size_t m = 0; m < maps.size(); ++m) {
    for (std::size_t n = 0; n < maps[m].places.size(); ++n)
      compared.push_back({leastDifference(views.few, maps[m].places[n].ranges, 1.0), m, n});
  }
  std::stable_sort(compared.begin(), compared.end(),
                   [](const Compared& a, const Compared& b) { return a.difference < b.difference; });
  return compared;
}

/// Places that are compared with all views.
std::size_t lookedAt(std::size_t places, std::size_t least) {
  constexpr double kShare = 0.15;
  return std::min(places, std::max(least, static_cast<std::size_t>(kShare * static_cast<double>(places))));
}

/// The least difference at each turn of a place, and the view that has it.
struct TurnedView {
  double difference = 1.0;
  const ScanView* view = nullptr;
};
using Turns = std::array<TurnedView, kPlaceAzimuths>;

Turns bestViews(const ScanViews& views, const PlaceRanges& place) {
  constexpr double kWorse = 0.08;  // than the place's best turn: not of interest
  const WidePlace wide(place);
  Turns turns;
  double best = 1.0;
  for (const auto* list : {&views.few, &views.rest}) {
    for (const ScanView& view : *list) {
      for (int turn = 0; turn < kPlaceAzimuths; ++turn) {
        TurnedView& known = turns[static_cast<std::size_t>(turn)];
        const double limit = std::min(known.difference, best + kWorse);
        const double one = view.seen.differenceAt(wide, turn, limit);
        if (!(one < limit)) continue;
        known = {one, &view};
        best = std::min(best, one);
      }
    }
  }
  return turns;
}

/// Turns that are better than those beside them, the best first.
std::vector<std::size_t> minima(const Turns& turns, std::size_t most) {
  std::vector<std::size_t> found;
  for (std::size_t n = 0; n < turns.size(); ++n) {
    const double before = turns[(n + turns.size() - 1) % turns.size()].difference,
                 after = turns[(n + 1) % turns.size()].difference;
    if (turns[n].view && turns[n].difference < before && turns[n].difference <= after) found.push_back(n);
  }
  std::stable_sort(found.begin(), found.end(), [&turns](std::size_t a, std::size_t b) {
    return turns[a].difference < turns[b].difference;
  });
  if (found.size() > most) found.resize(most);
  return found;
}

}  // namespace

std::vector<PlaceIndex::Ranked> PlaceIndex::rank(const Eigen::Matrix3Xf& points_sensor,
                                                 const Eigen::Vector3d& down_sensor) const {
  const ScanViews views = viewsOf(points_sensor, down_sensor, options_.spacing);
  const std::vector<Compared> compared = compareAll(maps_, views);
  std::vector<Ranked> ranked;
  for (const Entry& map : maps_) ranked.push_back({map.name, 1.0});
  constexpr std::size_t kLeastLooked = 64;
  const std::size_t looked = lookedAt(compared.size(), kLeastLooked);
  for (std::size_t n = 0; n < compared.size(); ++n) {
    const Compared& one = compared[n];
    double& best = ranked[one.map].difference;
    best = std::min(best, one.difference);
    if (n < looked) best = leastDifference(views.rest, maps_[one.map].places[one.place].ranges, best);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Ranked& a, const Ranked& b) { return a.difference < b.difference; });
  return ranked;
}

std::vector<PlaceIndex::Hypothesis> PlaceIndex::hypotheses(const Eigen::Matrix3Xf& points_sensor,
                                                           const Eigen::Vector3d& down_sensor) const {
  constexpr std::size_t kTurns = 4;  // of a place: rooms are symmetric
  // A few views lose the right place too often: in a building of this many places all are compared with all.
  constexpr std::size_t kLeastLooked = 4000;
  constexpr double kStep = 2.0 * M_PI / kPlaceAzimuths;
  const ScanViews views = viewsOf(points_sensor, down_sensor, options_.spacing);
  const std::vector<Compared> compared = compareAll(maps_, views);
  const std::size_t looked = lookedAt(compared.size(), kLeastLooked);
  const Eigen::Quaterniond level = levelling(down_sensor);
  std::vector<Hypothesis> found;
  for (std::size_t n = 0; n < looked; ++n) {
    const IndexedPlace& place = maps_[compared[n].map].places[compared[n].place];
    const Turns turns = bestViews(views, place.ranges);
    for (const std::size_t turn : minima(turns, kTurns)) {
      const TurnedView& best = turns[turn];
      const Eigen::AngleAxisd yaw(static_cast<double>(turn) * kStep - best.view->yaw,
                                  Eigen::Vector3d::UnitZ());
      found.push_back({maps_[compared[n].map].name, best.difference, place.inBox(),
                       yaw * Eigen::Vector3d(-best.view->from), yaw * level});
    }
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.difference < b.difference; });
  return found;
}

std::size_t PlaceIndex::placeCount() const {
  std::size_t count = 0;
  for (const Entry& map : maps_) count += map.places.size();
  return count;
}

}  // namespace ttsdf
