#pragma once
// A scan as the index of places compares it: the ranges that it shows from points around the sensor.

#include <Eigen/Geometry>
#include <vector>

#include "ttsdf_localization/atlas/place_index.h"

namespace ttsdf {

constexpr double kPlaceRows[kPlaceElevations] = {-0.60, -0.36, -0.12, 0.12, 0.36, 0.60};  // [rad]
constexpr double kFarthestPlaceRange = (kNoRange - 1) * kPlaceRangeStep;

inline std::size_t placeBin(int elevation, int azimuth) {
  return static_cast<std::size_t>(elevation * kPlaceAzimuths + azimuth);
}
/// A range [m] as it is kept.
std::uint8_t placeRange(double range);

/// A place with every row twice, so that no azimuth has to be taken modulo.
class WidePlace {
 public:
  static constexpr int kRow = 2 * kPlaceAzimuths;
  explicit WidePlace(const PlaceRanges& place);
  const std::uint8_t* turned(int turn) const { return ranges_.data() + turn; }

 private:
  std::array<std::uint8_t, kRow * kPlaceElevations> ranges_;
};

/// The directions that a scan has, ready to be compared.
class SeenDirections {
 public:
  explicit SeenDirections(const PlaceRanges& scan);
  std::size_t size() const { return seen_.size(); }
  bool enough() const { return seen_.size() >= 4; }

  /// Least mean difference over all turns, if it is below `best`; `best` otherwise.
  double difference(const WidePlace& place, double best) const;
  /// The same at one turn: the scan's azimuth 0 is the place's azimuth `turn`.
  double differenceAt(const WidePlace& place, int turn, double best) const;

 private:
  struct Direction {
    int bin;
    const std::uint8_t* row;  ///< differences to all ranges
  };
  std::vector<Direction> seen_;
};

/// The scan from one point of its level frame, with azimuths that begin at `yaw`.
struct ScanView {
  Eigen::Vector3d from;  ///< [m]
  double yaw;            ///< [rad]
  SeenDirections seen;
};

/// The scan from points within half a spacing of the sensor.
struct ScanViews {
  std::vector<ScanView> few, rest;  ///< a few of them tell which places are worth all
};
ScanViews viewsOf(const Eigen::Matrix3Xf& points, const Eigen::Vector3d& down, double spacing);

/// From the sensor to its level frame.
Eigen::Quaterniond levelling(const Eigen::Vector3d& down_sensor);

}  // namespace ttsdf
