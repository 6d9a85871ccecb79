#pragma once
// What places of many maps look like, in a few bytes each: tells in which maps a scan without a prior is
// worth searching.
//
// A place is a point in free space and the ranges to the surfaces around it: 48 azimuths at six elevations.
// A scan whose down direction is known is compared with every place at every turn about the vertical, as it
// would look from points around the sensor: places lie a metre apart, and ranges change within a metre.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "ttsdf_localization/atlas/atlas_field.h"
#include "ttsdf_localization/atlas/oriented_box.h"

namespace ttsdf {

constexpr int kPlaceAzimuths = 48, kPlaceElevations = 6;
constexpr std::uint8_t kNoRange = 255;  ///< nothing known in this direction

/// Ranges in steps of kPlaceRangeStep; row by row of azimuths.
using PlaceRanges = std::array<std::uint8_t, kPlaceAzimuths * kPlaceElevations>;
constexpr double kPlaceRangeStep = 0.03;  ///< [m]

/// What is seen from a point, and where in its map's box the point lies.
struct IndexedPlace {
  static constexpr double kStep = 0.01;  ///< of `at` [m]
  PlaceRanges ranges;
  std::array<std::uint16_t, 3> at;

  static std::array<std::uint16_t, 3> stepsOf(const Eigen::Vector3d& in_box);
  Eigen::Vector3d inBox() const { return kStep * Eigen::Vector3d(at[0], at[1], at[2]); }
  bool operator==(const IndexedPlace& other) const { return ranges == other.ranges && at == other.at; }
};

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

  /// A pose that would show about what the scan shows, to a fifth of the spacing and half an azimuth.
  struct Hypothesis {
    std::string map;
    double difference;
    Eigen::Vector3d place;   ///< in the map's box [m]
    Eigen::Vector3d beside;  ///< of the sensor from the place, axes of the atlas [m]
    Eigen::Quaterniond R_atlas_sensor;
    Eigen::Isometry3d poseIn(const OrientedBox& box) const {
      return Eigen::Translation3d(box.T_atlas_box * place + beside) * R_atlas_sensor;
    }
  };

  /// The places of a map.
  struct Entry {
    std::string name;
    std::uint32_t key = 0;  ///< what they were made from (placeKeys)
    std::vector<IndexedPlace> places;
  };

  explicit PlaceIndex(const PlaceIndexOptions& options = {}) : options_(options) {}
  /// Looks around at a map's places, across its borders: `around` is the map and those that overlap with it,
  /// itself first. Places that another map holds deeper are left to that one. Far fields are needed (throws
  /// std::invalid_argument). Takes about 2 ms a place.
  void add(const std::vector<PlacedField>& around, std::uint32_t key = 0);
  /// In the place of the entry of this name.
  void put(Entry map);
  /// Null if there is none of this name.
  const Entry* find(const std::string& name) const;
  const std::vector<Entry>& maps() const { return maps_; }
  /// Maps by their most alike place, the best first. `down_sensor`: unit vector.
  std::vector<Ranked> rank(const Eigen::Matrix3Xf& points_sensor, const Eigen::Vector3d& down_sensor) const;

  /// Poses of all maps, the most alike first.
  std::vector<Hypothesis> hypotheses(const Eigen::Matrix3Xf& points_sensor,
                                     const Eigen::Vector3d& down_sensor) const;

  std::size_t placeCount() const;
  std::size_t memoryBytes() const { return placeCount() * sizeof(IndexedPlace); }

 private:
  PlaceIndexOptions options_;
  std::vector<Entry> maps_;
};

/// Ranges of a scan in a level frame, kNoRange where it has no points. Mean range of the points near each
/// direction. `from`: seen from this point of the level frame, whose origin is the sensor [m]; `yaw`: with
/// azimuths that begin there [rad].
PlaceRanges rangesOfScan(const Eigen::Matrix3Xf& points_sensor, const Eigen::Vector3d& down_sensor,
                         const Eigen::Vector3d& from = Eigen::Vector3d::Zero(), double yaw = 0.0);
/// Mean difference over the directions that the scan has, at the best turn; 1 if it has too few.
double placeDifference(const PlaceRanges& scan, const PlaceRanges& place);

}  // namespace ttsdf
