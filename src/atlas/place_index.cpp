#include "ttsdf_localization/atlas/place_index.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "atlas_members.h"

namespace ttsdf {

namespace {

constexpr double kElevations[kPlaceElevations] = {-0.5, -0.17, 0.17};  // [rad]
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

PlaceRanges rangesOfScan(const Eigen::Matrix3Xf& points_sensor, const Eigen::Vector3d& down_sensor) {
  constexpr double kBand = 0.09;  // half height of a row [rad]
  const Eigen::Matrix3f R = Eigen::Quaterniond::FromTwoVectors(down_sensor, -Eigen::Vector3d::UnitZ())
                                .toRotationMatrix()
                                .cast<float>();
  std::array<double, kPlaceAzimuths * kPlaceElevations> sums{};
  std::array<int, kPlaceAzimuths * kPlaceElevations> counts{};
  for (Eigen::Index n = 0; n < points_sensor.cols(); ++n) {
    const Eigen::Vector3f p = R * points_sensor.col(n);
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

double placeDifference(const PlaceRanges& scan, const PlaceRanges& place) {
  constexpr int kLeast = 4;               // directions, to say anything
  constexpr double kUnknownIs = 0.7;      // the scan sees a surface where the map knows nothing
  std::vector<std::pair<int, int>> seen;  // elevation, azimuth
  for (int e = 0; e < kPlaceElevations; ++e) {
    for (int a = 0; a < kPlaceAzimuths; ++a) {
      if (scan[binOf(e, a)] != kNoRange) seen.emplace_back(e, a);
    }
  }
  if (seen.size() < static_cast<std::size_t>(kLeast)) return 1.0;
  double best = 1.0;
  for (int turn = 0; turn < kPlaceAzimuths; ++turn) {
    double sum = 0.0;
    for (const auto& [e, a] : seen) {
      const std::uint8_t there = place[binOf(e, (a + turn) % kPlaceAzimuths)];
      sum += there == kNoRange ? kUnknownIs : differenceOf(scan[binOf(e, a)], there);
    }
    best = std::min(best, sum / static_cast<double>(seen.size()));
  }
  return best;
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
  const PlaceRanges scan = rangesOfScan(points_sensor, down_sensor);
  std::vector<Ranked> ranked;
  for (const Entry& map : maps_) {
    double best = 1.0;
    for (const PlaceRanges& place : map.places) best = std::min(best, placeDifference(scan, place));
    ranked.push_back({map.name, best});
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
