#include "ros/server/map_server_ros.h"

#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {

MapServerRos::MapServerRos(ros::NodeHandle nh, const ros::NodeHandle& options, const std::string& map_file)
    : map_(nh) {
  try {
    map_.set(readFile(map_file));
  } catch (const MapFormatError& error) {
    throw MapFormatError(map_file + ": " + error.what());
  }
  const auto held = map_.held();
  planners_ = std::make_unique<PlannerOutput>(nh, options, *held->map);
  const auto& dims = held->map->geometry.dims;
  ROS_INFO_STREAM("Serving map " << held->message.map_id << " (" << map_file << ", "
                                 << held->message.data.size() << " bytes, " << dims[0] << " x " << dims[1]
                                 << " x " << dims[2] << " voxels) in frame '" << held->map->frame_id << "'");
}

}  // namespace ttsdf
