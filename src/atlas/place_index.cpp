#include "ttsdf_localization/atlas/place_index.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "atlas_members.h"

namespace ttsdf {

namespace {

constexpr double kElevations[kPlaceElevations] = {-0.60, -0.36, -0.12, 0.12, 0.36, 0.60};  // [rad]
constexpr double kFarthest = (kNoRange - 1) * kPlaceRangeStep;

std::size_t binOf(int elevation, int azimuth) {
  return static_cast<std::size_t>(elevation * kPlaceAzimuths + azimuth);
}

std::uint8_t toStep(double range) {
  if (!(range < kFarthest)) return kNoRange;
  return static_cast<std::uint8_t>(std::lround(range / kPlaceRangeStep));
}

/// Ranges from one point, by rays that leap as far as the far field lets them.
PlaceRanges lookAround(const DistanceField& field, const DistanceField& far_field,
                       const Eigen::Vector3f& from) {
  constexpr int kRays = kPlaceAzimuths * kPlaceElevations, kMostSteps = 200;
  const auto voxel = static_cast<float>(field.geometry().voxel_size);
  const float blur = 0.75F * static_cast<float>(far_field.geometry().voxel_size);
  std::vector<Eigen::Vector3f> directions;
  for (const double elevation : kElevations) {
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
        ranges[n] = toStep(static_cast<double>(at[n]));
        continue;
      }
      const float free = std::max(near.states[k] == PointState::kValid ? near.values[column] : 0.0F,
                                  std::abs(far.values[column]) - blur);
      at[n] += std::max(free, 0.5F * voxel);
      if (at[n] < static_cast<float>(kFarthest)) still.push_back(going[k]);
    }
    going = std::move(still);
  }
  return ranges;
}

/// Differences that are usual half a spacing away from a place count half.
double differenceOf(std::uint8_t a, std::uint8_t b) {
  const double nearer = kPlaceRangeStep * std::min(a, b), gap = kPlaceRangeStep * std::abs(a - b);
  return std::min(1.0, gap / (0.4 + 0.3 * nearer));
}

}  // namespace

PlaceRanges rangesOfScan(const Eigen::Matrix3Xf& points_sensor, const Eigen::Vector3d& down_sensor,
                         const Eigen::Vector3d& from, double yaw) {
  constexpr double kBand = 0.09;  // half height of a row [rad]
  const Eigen::Quaterniond level = Eigen::Quaterniond::FromTwoVectors(down_sensor, -Eigen::Vector3d::UnitZ());
  const Eigen::AngleAxisd turned(-yaw, Eigen::Vector3d::UnitZ());
  const Eigen::Matrix3f R = (turned * level).toRotationMatrix().cast<float>();
  const Eigen::Vector3f shift = (turned * from).cast<float>();
  std::array<double, kPlaceAzimuths * kPlaceElevations> sums{};
  std::array<int, kPlaceAzimuths * kPlaceElevations> counts{};
  for (Eigen::Index n = 0; n < points_sensor.cols(); ++n) {
    const Eigen::Vector3f p = R * points_sensor.col(n) - shift;
    const double range = static_cast<double>(p.norm());
    if (!(range > 0.0) || !std::isfinite(range)) continue;
    const double elevation = std::asin(static_cast<double>(p.z()) / range);
    const double turns = std::atan2(static_cast<double>(p.y()), static_cast<double>(p.x())) / (2.0 * M_PI);
    const int azimuth =
        std::min(kPlaceAzimuths - 1, static_cast<int>((turns - std::floor(turns)) * kPlaceAzimuths));
    for (int e = 0; e < kPlaceElevations; ++e) {
      if (std::abs(elevation - kElevations[e]) > kBand) continue;
      sums[binOf(e, azimuth)] += range;
      ++counts[binOf(e, azimuth)];
    }
  }
  PlaceRanges ranges;
  for (std::size_t n = 0; n < ranges.size(); ++n)
    ranges[n] = counts[n] < 2 ? kNoRange : toStep(sums[n] / counts[n]);
  return ranges;
}

namespace {

/// Differences of all pairs of ranges, in 255ths.
class DifferenceTable {
 public:
  DifferenceTable() {
    constexpr double kUnknownIs = 0.7;  // the scan sees a surface where the map knows nothing
    for (int a = 0; a < 256; ++a) {
      for (int b = 0; b < 256; ++b) {
        const double difference =
            b == kNoRange ? kUnknownIs
                          : differenceOf(static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b));
        values_[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)] =
            static_cast<std::uint8_t>(std::lround(255.0 * difference));
      }
    }
  }
  const std::uint8_t* of(std::uint8_t range) const { return values_[range].data(); }

 private:
  std::array<std::array<std::uint8_t, 256>, 256> values_;
};

/// A place with every row twice, so that no azimuth has to be taken modulo.
class WidePlace {
 public:
  static constexpr int kRow = 2 * kPlaceAzimuths;
  explicit WidePlace(const PlaceRanges& place) {
    for (int e = 0; e < kPlaceElevations; ++e) {
      for (int a = 0; a < kRow; ++a)
        ranges_[static_cast<std::size_t>(e * kRow + a)] = place[binOf(e, a % kPlaceAzimuths)];
    }
  }
  const std::uint8_t* turned(int turn) const { return ranges_.data() + turn; }

 private:
  std::array<std::uint8_t, kRow * kPlaceElevations> ranges_;
};

/// The directions that a scan has, ready to be compared.
class SeenDirections {
 public:
  explicit SeenDirections(const PlaceRanges& scan) {
    static const DifferenceTable table;
    for (int e = 0; e < kPlaceElevations; ++e) {
      for (int a = 0; a < kPlaceAzimuths; ++a) {
        const std::uint8_t range = scan[binOf(e, a)];
        if (range != kNoRange) seen_.push_back({e * WidePlace::kRow + a, table.of(range)});
      }
    }
  }
  std::size_t size() const { return seen_.size(); }
  bool enough() const { return seen_.size() >= 4; }

  /// Least mean difference over all turns, if it is below `best`; `best` otherwise.
  double difference(const WidePlace& place, double best) const {
    if (!enough()) return best;
    const double full = 255.0 * static_cast<double>(seen_.size());
    auto limit = static_cast<unsigned>(best * full);
    for (int turn = 0; turn < kPlaceAzimuths; ++turn) {
      const std::uint8_t* const there = place.turned(turn);
      unsigned sum = 0;
      for (std::size_t n = 0; n < seen_.size() && sum < limit; ++n) sum += seen_[n].row[there[seen_[n].bin]];
      if (sum < limit) {
        limit = sum;
        best = sum / full;
      }
    }
    return best;
  }

 private:
  struct Direction {
    int bin;
    const std::uint8_t* row;  ///< differences to all ranges
  };
  std::vector<Direction> seen_;
};

/// The scan from points within half a spacing of the sensor.
struct ScanViews {
  std::vector<SeenDirections> few, rest;  ///< a few of them tell which places are worth all
};

ScanViews viewsOf(const Eigen::Matrix3Xf& points, const Eigen::Vector3d& down, double spacing) {
  constexpr int kAside = 5, kAbove = 3;
  constexpr Eigen::Index kMostPoints = 2000;
  constexpr double kLeastSeen = 0.6;  // of the directions that the sensor itself sees
  const Eigen::Index stride = std::max<Eigen::Index>(1, points.cols() / kMostPoints);
  Eigen::Matrix3Xf some(3, (points.cols() + stride - 1) / stride);
  for (Eigen::Index n = 0; n < some.cols(); ++n) some.col(n) = points.col(n * stride);
  ScanViews views;
  const auto least = kLeastSeen * static_cast<double>(SeenDirections(rangesOfScan(some, down)).size());
  const auto add = [&](const Eigen::Array3d& share, double phase, std::vector<SeenDirections>& list) {
    const Eigen::Vector3d from = spacing * (share - 0.5).matrix();
    SeenDirections view(rangesOfScan(some, down, from, phase * 2.0 * M_PI / kPlaceAzimuths));
    if (view.enough() && static_cast<double>(view.size()) >= least) list.push_back(std::move(view));
  };
  for (int k = 0; k < kAbove; ++k) {
    for (int j = 0; j < kAside; ++j) {
      for (int i = 0; i < kAside; ++i) {
        const Eigen::Array3d share((i + 0.5) / kAside, (j + 0.5) / kAside, (k + 0.5) / kAbove);
        const bool one_of_few = i % 2 == 1 && j % 2 == 1 && k == kAbove / 2;
        add(share, 0.0, one_of_few ? views.few : views.rest);
        add(share, 0.5, views.rest);
      }
    }
  }
  return views;
}

double leastDifference(const std::vector<SeenDirections>& views, const PlaceRanges& place, double best) {
  const WidePlace wide(place);
  for (const SeenDirections& view : views) best = view.difference(wide, best);
  return best;
}

}  // namespace

double placeDifference(const PlaceRanges& scan, const PlaceRanges& place) {
  return SeenDirections(scan).difference(WidePlace(place), 1.0);
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
  for (int k = 0; k < count[2]; ++k) {
    for (int j = 0; j < count[1]; ++j) {
      for (int i = 0; i < count[0]; ++i) {
        const Eigen::Vector3d share = (Eigen::Array3d(i, j, k) + 0.5) / count.cast<double>();
        const Eigen::Vector3d p = box.T_atlas_box * box.size.cwiseProduct(share);
        if (deepestOf(around, p) == 0) points.push_back((p - field.geometry().origin).cast<float>());
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
      entry.places.push_back(lookAround(field, *far_field, points[n]));
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

std::vector<PlaceIndex::Ranked> PlaceIndex::rank(const Eigen::Matrix3Xf& points_sensor,
                                                 const Eigen::Vector3d& down_sensor) const {
  constexpr std::size_t kLeastLooked = 64;  // places that are compared with all views, ...
  constexpr double kShareLooked = 0.15;     // ... and the share of all places
  const ScanViews views = viewsOf(points_sensor, down_sensor, options_.spacing);
  struct Compared {
    double difference;
    std::size_t map, place;
  };
  std::vector<Compared> compared;
  std::vector<Ranked> ranked;
  for (std::size_t m = 0; m < maps_.size(); ++m) {
    ranked.push_back({maps_[m].name, 1.0});
    for (std::size_t n = 0; n < maps_[m].places.size(); ++n)
      compared.push_back({leastDifference(views.few, maps_[m].places[n], 1.0), m, n});
  }
  std::stable_sort(compared.begin(), compared.end(),
                   [](const Compared& a, const Compared& b) { return a.difference < b.difference; });
  const auto looked =
      std::max(kLeastLooked, static_cast<std::size_t>(kShareLooked * static_cast<double>(compared.size())));
  for (std::size_t n = 0; n < compared.size(); ++n) {
    const Compared& one = compared[n];
    double& best = ranked[one.map].difference;
    best = std::min(best, one.difference);
    if (n < looked) best = leastDifference(views.rest, maps_[one.map].places[one.place], best);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Ranked& a, const Ranked& b) { return a.difference < b.difference; });
  return ranked;
}

std::size_t PlaceIndex::placeCount() const {
  std::size_t count = 0;
  for (const Entry& map : maps_) count += map.places.size();
  return count;
}

}  // namespace ttsdf
