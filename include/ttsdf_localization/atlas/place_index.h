#pragma once
// What places of many maps look like, in a few bytes each: tells in which maps a scan without a prior is
// worth searching.
//
// A place is a point in free space and the ranges to the surfaces around it: 48 azimuths at three elevations.
// A scan whose down direction is known is compared with every place at every turn about the vertical.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "ttsdf_localization/atlas/atlas_field.h"

namespace ttsdf {

constexpr int kPlaceAzimuths = 48, kPlaceElevations = 3;
constexpr std::uint8_t kNoRange = 255;  ///< nothing known in this direction

/// Ranges in steps of kPlaceRangeStep; row by row of azimuths.
using PlaceRanges = std::array<std::uint8_t, kPlaceAzimuths * kPlaceElevations>;
constexpr double kPlaceRangeStep = 0.03;  ///< [m]

struct PlaceIndexOptions {
  double spacing = 1.0;    ///< of the places, along all axes [m]
  double clearance = 0.3;  ///< from the nearest surface [m]
};

class PlaceIndex {
 public:
  struct Ranked {
    std::string map;
    double difference;  ///< of its best place: 0 equal, 1 nothing alike
  };

  explicit PlaceIndex(const PlaceIndexOptions& options = {}) : options_(options) {}
  /// Looks at a map's places; its far field is needed (throws std::invalid_argument). Takes about 2 ms a
  /// place.
  void add(const PlacedField& map);
  /// Maps by their most alike place, the best first. `down_sensor`: unit vector.
  std::vector<Ranked> rank(const Eigen::Matrix3Xf& points_sensor, const Eigen::Vector3d& down_sensor) const;

  std::size_t mapCount() const { return maps_.size(); }
  std::size_t placeCount() const;
  std::size_t memoryBytes() const { return placeCount() * sizeof(PlaceRanges); }

 private:
  struct Entry {
    std::string name;
    std::vector<PlaceRanges> places;
  };
  PlaceIndexOptions options_;
  std::vector<Entry> maps_;
};

/// Ranges of a scan in a level frame, kNoRange where it has no points. Mean range of the points near each
/// direction.
PlaceRanges rangesOfScan(const Eigen::Matrix3Xf& points_sensor, const Eigen::Vector3d& down_sensor);
/// Mean difference over the directions that the scan has, at the best turn; 1 if it has too few.
double placeDifference(const PlaceRanges& scan, const PlaceRanges& place);

}  // namespace ttsdf
