#pragma once
// Shows the surface of the map that a localizer uses. For the operator's computer: it decompresses the whole
// map, which the robot's process never does.

#include <ros/ros.h>

#include <mutex>
#include <string>
#include <thread>

#include "ros/scans/newest_slot.h"
#include "ttsdf_localization/LocalizationStatus.h"
#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

struct MapSurfaceOptions {
  std::string localization = "localization";  ///< name of the localization node
  int max_triangles = 200000;                 ///< a larger surface is thinned
};
const OptionTable<MapSurfaceOptions>& mapSurfaceOptionTable();

/// Topic `status` tells which map is in use; its bytes come from the localizer's `~get_map`; the surface goes
/// to the latched topic `map_surface`.
class MapSurface {
 public:
  /// Reads the private parameters. Throws std::invalid_argument for bad ones.
  MapSurface(const ros::NodeHandle& node, const ros::NodeHandle& private_node);
  ~MapSurface();
  MapSurface(const MapSurface&) = delete;
  MapSurface& operator=(const MapSurface&) = delete;

 private:
  void onStatus(const ttsdf_localization::LocalizationStatus& status);
  void run();
  /// Throws std::runtime_error: the service fails, or the map is too large to be decompressed.
  void show();

  MapSurfaceOptions options_;
  ros::NodeHandle node_;
  ros::Publisher publisher_;
  ros::Subscriber subscriber_;
  std::mutex mutex_;
  std::string shown_;               ///< id of the map asked for last; empty after a failure
  NewestSlot<std::string> wanted_;  ///< ids of maps
  std::thread worker_;
};

}  // namespace ttsdf
