#include "ros/builder/map_views.h"

#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/Marker.h>

#include "ros/operator/map_visualization.h"
#include "ttsdf_localization/map/map_io.h"
#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf {

MapViews::MapViews(ros::NodeHandle nh, const MapBuilderRosOptions& options, const MapPublisher& map)
    : options_(options), map_(map) {
  const auto show_surface = [this](const ros::SingleSubscriberPublisher&) { publishMapSurface(); };
  const auto show_slice = [this](const ros::SingleSubscriberPublisher&) { publishSlice(); };
  surface_ = nh.advertise<visualization_msgs::Marker>("surface", 1, show_surface, {}, {}, true);
  slice_ = nh.advertise<sensor_msgs::PointCloud2>("slice", 1, show_slice);
}

void MapViews::showMap() {
  publishMapSurface();
  publishSlice();
}

void MapViews::publishMapSurface() {
  if (surface_.getNumSubscribers() == 0) return;
  const std::lock_guard<std::mutex> lock(surface_mutex_);
  const auto held = map_.held();
  if (!held || held->message.map_id == shown_map_id_) return;
  try {
    requireShowable(*held->map);
    surface_.publish(surfaceMarker(extractSurface(*held->map), options_.surface_triangles,
                                   held->map->frame_id, ros::Time::now()));
    shown_map_id_ = held->message.map_id;
  } catch (const std::exception& error) {
    ROS_WARN_STREAM("No surface of map " << held->message.map_id << ": " << error.what());
  }
}

void MapViews::showFused(ScanFuser& fuser) {
  if (surface_.getNumSubscribers() == 0) return;
  const std::uint32_t fused = fuser.counts().fused;
  const std::lock_guard<std::mutex> lock(surface_mutex_);
  if (fused == shown_scans_) return;
  try {
    SurfaceMesh mesh;
    fuser.withVolume([&](const TsdfVolume& volume) { mesh = extractSurface(volume); });
    surface_.publish(
        surfaceMarker(mesh, options_.surface_triangles, options_.global_frame_id, ros::Time::now()));
    shown_scans_ = fused;
    shown_map_id_.clear();
  } catch (const std::exception& error) {
    ROS_WARN_STREAM_THROTTLE(10.0, "No surface of the fused scans: " << error.what());
  }
}

void MapViews::publishSlice() {
  if (slice_.getNumSubscribers() == 0) return;
  const auto held = map_.held();
  if (!held) return;
  try {
    const auto field = makeField(*held->map);
    const double range =
        held->map->clamp_positive > 0.0 ? held->map->clamp_positive : 10.0 * held->map->geometry.voxel_size;
    slice_.publish(sliceCloud(*field, options_.slice_height, held->map->geometry.voxel_size, range,
                              held->map->frame_id, ros::Time::now()));
  } catch (const std::exception& error) {
    ROS_WARN_STREAM("No slice: " << error.what());
  }
}

}  // namespace ttsdf
