#pragma once
// What people see of the builder in rviz: the surface of the map or of what is being fused, and a slice of
// the map's distances.

#include <ros/ros.h>

#include <cstdint>
#include <mutex>
#include <string>

#include "ros/builder/map_builder_options.h"
#include "ros/builder/scan_fuser.h"
#include "ros/server/map_publisher.h"

namespace ttsdf {

/// Costly for a large map: made when somebody subscribes. Thread-safe.
class MapViews {
 public:
  /// Advertises `surface` and `slice` in `nh`; subscribers are served in nh's callback queue. `options` and
  /// `map` must outlive it.
  MapViews(ros::NodeHandle nh, const MapBuilderRosOptions& options, const MapPublisher& map);
  MapViews(const MapViews&) = delete;
  MapViews& operator=(const MapViews&) = delete;

  /// The map that is held now, to those who look.
  void showMap();
  /// The surface of the fused scans, if there are new ones.
  void showFused(ScanFuser& fuser);

 private:
  void publishMapSurface();
  void publishSlice();

  const MapBuilderRosOptions& options_;
  const MapPublisher& map_;
  std::mutex surface_mutex_;
  std::string shown_map_id_;       ///< map whose surface was published last
  std::uint32_t shown_scans_ = 0;  ///< fused scans in the surface published last
  ros::Publisher surface_, slice_;
};

}  // namespace ttsdf
