#include "ros/operator/map_surface.h"

#include <visualization_msgs/Marker.h>

#include <exception>
#include <stdexcept>

#include "ros/operator/map_visualization.h"
#include "ros/parameters/parameters.h"
#include "ttsdf_localization/GetMap.h"
#include "ttsdf_localization/map/map_io.h"
#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf {

namespace {
constexpr double kRetrySeconds = 2.0;

}  // namespace

const OptionTable<MapSurfaceOptions>& mapSurfaceOptionTable() {
  using O = MapSurfaceOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("localization", &O::localization, {}, "Name of the localization node.")
          .add("max_triangles", &O::max_triangles, 100, 10000000, "",
               "A larger surface is thinned to this size.");
  return table;
}

MapSurface::MapSurface(const ros::NodeHandle& node, const ros::NodeHandle& private_node)
    : options_(loadOptions(mapSurfaceOptionTable(), private_node)), node_(node) {
  publisher_ = node_.advertise<visualization_msgs::Marker>("map_surface", 1, true);
  worker_ = std::thread(&MapSurface::run, this);
  subscriber_ = node_.subscribe("status", 10, &MapSurface::onStatus, this);
}

MapSurface::~MapSurface() {
  subscriber_.shutdown();
  wanted_.close();
  worker_.join();
}

void MapSurface::onStatus(const ttsdf_localization::LocalizationStatus& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (status.map_id.empty() || status.map_id == shown_) return;
  shown_ = status.map_id;
  wanted_.put(status.map_id);
}

void MapSurface::run() {
  while (const auto map_id = wanted_.take()) {
    try {
      show();
    } catch (const std::exception& error) {
      ROS_WARN_STREAM("No surface of map " << *map_id << ": " << error.what());
      // The old map's surface would be taken for the new one's. The next status asks again, but not at once.
      publisher_.publish(surfaceMarker(SurfaceMesh(), options_.max_triangles, "map", ros::Time::now()));
      ros::WallDuration(kRetrySeconds).sleep();
      const std::lock_guard<std::mutex> lock(mutex_);
      if (shown_ == *map_id) shown_.clear();
    }
  }
}

void MapSurface::show() {
  const std::string service = node_.resolveName(options_.localization + "/get_map");
  ttsdf_localization::GetMap call;
  if (!ros::service::call(service, call)) throw std::runtime_error("'" + service + "' could not be called");
  if (!call.response.success) throw std::runtime_error("'" + service + "': " + call.response.message);
  const auto& bytes = call.response.map.data;
  const TtSdfMap map = deserialize(bytes.data(), bytes.size());
  requireShowable(map);
  publisher_.publish(surfaceMarker(extractSurface(map), options_.max_triangles,
                                   call.response.map.header.frame_id, ros::Time::now()));
}

}  // namespace ttsdf
