#include "ros/maps/atlas_messages.h"

#include <tf2_eigen/tf2_eigen.h>

#include <limits>
#include <stdexcept>
#include <utility>

namespace ttsdf {

namespace {

/// tf2 makes no rotation of a quaternion that is none; check() then names the map.
Eigen::Isometry3d poseOf(const geometry_msgs::Pose& message) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  tf2::fromMsg(message, T);
  return T;
}

}  // namespace

ttsdf_localization::AtlasMapInfo toMessage(const AtlasMap& map) {
  ttsdf_localization::AtlasMapInfo info;
  info.name = map.name;
  info.map_id = map.map_id;
  info.bytes = map.bytes;
  info.version = static_cast<std::uint32_t>(map.version);
  info.voxel_size = map.voxel_size;
  info.pose = tf2::toMsg(map.T_atlas_map);
  info.box = tf2::toMsg(map.T_map_box);
  info.size.x = map.size.x(), info.size.y = map.size.y(), info.size.z = map.size.z();
  return info;
}

ttsdf_localization::AtlasInfo toMessage(const Atlas& atlas, std::vector<std::uint8_t> places) {
  ttsdf_localization::AtlasInfo message;
  message.header.frame_id = atlas.frame_id;
  for (const AtlasMap& map : atlas.maps) message.maps.push_back(toMessage(map));
  message.places = std::move(places);
  return message;
}

Atlas fromMessage(const ttsdf_localization::AtlasInfo& message) {
  Atlas atlas;
  atlas.frame_id = message.header.frame_id;
  for (const ttsdf_localization::AtlasMapInfo& info : message.maps) {
    AtlasMap map;
    map.name = info.name;
    map.file = info.name + ".ttsdf";
    map.map_id = info.map_id;
    map.bytes = info.bytes;
    if (info.version > static_cast<std::uint32_t>(std::numeric_limits<int>::max()))
      throw std::invalid_argument("atlas: map '" + info.name + "': got a version above the largest integer");
    map.version = static_cast<int>(info.version);
    map.voxel_size = info.voxel_size;
    map.T_atlas_map = poseOf(info.pose);
    map.T_map_box = poseOf(info.box);
    map.size = Eigen::Vector3d(info.size.x, info.size.y, info.size.z);
    atlas.maps.push_back(std::move(map));
  }
  check(atlas);
  return atlas;
}

}  // namespace ttsdf
