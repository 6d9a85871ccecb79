#pragma once
// Global localization over a folder of maps: the index of places stays in memory, maps come and go as the
// search needs them.

#include <map>
#include <memory>
#include <string>

#include "ttsdf_localization/atlas/atlas.h"
#include "ttsdf_localization/atlas/atlas_search.h"
#include "ttsdf_localization/atlas/moving_search.h"

namespace ttsdf {

struct AtlasLocatorOptions {
  double memory_megabytes = 60.0;  ///< of the maps that a search holds
  double map_megabytes = 4.0;      ///< of one (TtFieldOptions::memory_megabytes)
  MapLimits limits;                ///< of one map file
  AtlasSearchOptions search;       ///< maps_at_once is lowered to what the memory holds
  MovingSearchOptions moving;
};

/// Not thread-safe; one search at a time.
class AtlasLocator {
 public:
  /// Reads the index of the folder as far as it is there. Throws std::invalid_argument for an atlas or
  /// options that cannot be used.
  AtlasLocator(const std::string& folder, Atlas atlas, const AtlasLocatorOptions& options = {});
  /// Maps from anywhere; `places`: an index of places as places.bin holds it, may be empty.
  AtlasLocator(MapBytes files, Atlas atlas, const std::vector<std::uint8_t>& places,
               const AtlasLocatorOptions& options = {});
  ~AtlasLocator();
  AtlasLocator(const AtlasLocator&) = delete;
  AtlasLocator& operator=(const AtlasLocator&) = delete;

  /// Looks around in the maps that the index lacks (reads them and their neighbours; seconds a map). Maps
  /// that cannot be read are reported by failed() and tried again by the next call. False: cancelled.
  bool completeIndex(const ProgressCallback& progress = {});
  const PlaceIndex& index() const;
  /// Completes the index first; a map without places counts as one that may hold every scan. Without
  /// `down_sensor` all maps are searched, in the order of the atlas.
  AtlasLocation locate(const ScanPoints& points, const std::optional<Eigen::Vector3d>& down_sensor,
                       const ProgressCallback& progress = {});
  /// The next scan of a robot that moves between them: decides where one scan alone is ambiguous
  /// (MovingSearch).
  AtlasLocation locateMoving(const ScanPoints& points, const Eigen::Vector3d& down_sensor,
                             const Eigen::Isometry3d& T_odom_sensor, const ProgressCallback& progress = {});
  /// Scans of locateMoving() are forgotten: the robot was carried elsewhere, or its odometry jumped.
  void forgetScans();
  /// Scans of locateMoving() that counted.
  int movingScans() const;
  /// Map -> why it could not be used; "" -> why the file of the index could not.
  const std::map<std::string, std::string>& failed() const;
  /// Maps that a search keeps are let go.
  void releaseMaps();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ttsdf
