#include "scan_views.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ttsdf {

Eigen::Quaterniond levelling(const Eigen::Vector3d& down_sensor) {
  return Eigen::Quaterniond::FromTwoVectors(down_sensor, -Eigen::Vector3d::UnitZ());
}

std::uint8_t placeRange(double range) {
  if (!(range < kFarthestPlaceRange)) return kNoRange;
  return static_cast<std::uint8_t>(std::lround(range / kPlaceRangeStep));
}

PlaceRanges rangesOfScan(const Eigen::Matrix3Xf& points_sensor, const Eigen::Vector3d& down_sensor,
                         const Eigen::Vector3d& from, double yaw) {
  constexpr double kBand = 0.09;  // half height of a row [rad]
  const Eigen::Quaterniond level = levelling(down_sensor);
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
      if (std::abs(elevation - kPlaceRows[e]) > kBand) continue;
      sums[placeBin(e, azimuth)] += range;
      ++counts[placeBin(e, azimuth)];
    }
  }
  PlaceRanges ranges;
  for (std::size_t n = 0; n < ranges.size(); ++n)
    ranges[n] = counts[n] < 2 ? kNoRange : placeRange(sums[n] / counts[n]);
  return ranges;
}

namespace {

/// Differences that are usual half a spacing away from a place count half.
double differenceOf(std::uint8_t a, std::uint8_t b) {
  const double nearer = kPlaceRangeStep * std::min(a, b), gap = kPlaceRangeStep * std::abs(a - b);
  return std::min(1.0, gap / (0.4 + 0.3 * nearer));
}

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

}  // namespace

WidePlace::WidePlace(const PlaceRanges& place) {
  for (int e = 0; e < kPlaceElevations; ++e) {
    for (int a = 0; a < kRow; ++a)
      ranges_[static_cast<std::size_t>(e * kRow + a)] = place[placeBin(e, a % kPlaceAzimuths)];
  }
}

SeenDirections::SeenDirections(const PlaceRanges& scan) {
  static const DifferenceTable table;
  for (int e = 0; e < kPlaceElevations; ++e) {
    for (int a = 0; a < kPlaceAzimuths; ++a) {
      const std::uint8_t range = scan[placeBin(e, a)];
      if (range != kNoRange) seen_.push_back({e * WidePlace::kRow + a, table.of(range)});
    }
  }
  // Directions beside each other tell the same: in mixed order most places are out after a few.
  std::vector<Direction> mixed;
  constexpr std::size_t kApart = 29;
  for (std::size_t first = 0; first < kApart; ++first) {
    for (std::size_t n = first; n < seen_.size(); n += kApart) mixed.push_back(seen_[n]);
  }
  seen_ = std::move(mixed);
}

double SeenDirections::differenceAt(const WidePlace& place, int turn, double best) const {
  if (!enough()) return best;
  const double full = 255.0 * static_cast<double>(seen_.size());
  const auto limit = static_cast<unsigned>(best * full);
  const std::uint8_t* const there = place.turned(turn);
  unsigned sum = 0;
  constexpr std::size_t kAtOnce = 8;
  std::size_t n = 0;
  for (; n + kAtOnce <= seen_.size() && sum < limit; n += kAtOnce) {
    for (std::size_t k = n; k < n + kAtOnce; ++k) sum += seen_[k].row[there[seen_[k].bin]];
  }
  for (; n < seen_.size() && sum < limit; ++n) sum += seen_[n].row[there[seen_[n].bin]];
  return sum < limit ? sum / full : best;
}

double SeenDirections::difference(const WidePlace& place, double best) const {
  for (int turn = 0; turn < kPlaceAzimuths; ++turn) best = differenceAt(place, turn, best);
  return best;
}

double placeDifference(const PlaceRanges& scan, const PlaceRanges& place) {
  return SeenDirections(scan).difference(WidePlace(place), 1.0);
}

ScanViews viewsOf(const Eigen::Matrix3Xf& points, const Eigen::Vector3d& down, double spacing) {
  constexpr int kAside = 5, kAbove = 3;
  constexpr Eigen::Index kMostPoints = 2000;
  constexpr double kLeastSeen = 0.6;  // of the directions that the sensor itself sees
  const Eigen::Index stride = std::max<Eigen::Index>(1, points.cols() / kMostPoints);
  Eigen::Matrix3Xf some(3, (points.cols() + stride - 1) / stride);
  for (Eigen::Index n = 0; n < some.cols(); ++n) some.col(n) = points.col(n * stride);
  ScanViews views;
  const auto least = kLeastSeen * static_cast<double>(SeenDirections(rangesOfScan(some, down)).size());
  const auto add = [&](const Eigen::Array3d& share, double phase, std::vector<ScanView>& list) {
    const Eigen::Vector3d from = spacing * (share - 0.5).matrix();
    const double yaw = phase * 2.0 * M_PI / kPlaceAzimuths;
    SeenDirections seen(rangesOfScan(some, down, from, yaw));
    if (seen.enough() && static_cast<double>(seen.size()) >= least)
      list.push_back({from, yaw, std::move(seen)});
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

}  // namespace ttsdf
