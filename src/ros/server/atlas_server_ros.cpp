#include "ros/server/atlas_server_ros.h"

#include <algorithm>
#include <exception>
#include <stdexcept>
#include <utility>

#include "ros/maps/atlas_messages.h"
#include "ros/maps/folder_watch.h"
#include "ros/maps/service_answer.h"
#include "ttsdf_localization/atlas/map_difference.h"
#include "ttsdf_localization/atlas/place_index_file.h"

namespace ttsdf {

namespace {

constexpr double kLookPeriod = 1.0;                                         // [s]
constexpr std::size_t kMostMaps = 64, kMostBytes = std::size_t{128} << 20;  // of one answer

}  // namespace

AtlasServerRos::AtlasServerRos(ros::NodeHandle nh, const std::string& folder)
    : folder_(folder), publisher_(nh.advertise<ttsdf_localization::AtlasInfo>("atlas", 1, true)) {
  load();
  services_ = {nh.advertiseService("get_differential_map", &AtlasServerRos::getDifference, this),
               nh.advertiseService("get_selected_maps", &AtlasServerRos::getSelected, this)};
  timer_ = nh.createWallTimer(ros::WallDuration(kLookPeriod),
                              [this](const ros::WallTimerEvent&) { lookForChanges(); });
}

void AtlasServerRos::load() {
  seen_ = stateOfAtlas(folder_);
  auto atlas = std::make_shared<const Atlas>(readAtlas(folder_));
  std::vector<std::uint8_t> places;
  try {
    places = serialize(readPlaceIndex(folder_, *atlas));
  } catch (const std::exception& error) {
    ROS_WARN_STREAM(error.what() << "; robots make it themselves (ttsdf_atlas index)");
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    atlas_ = atlas;
  }
  auto message = toMessage(*atlas, std::move(places));
  message.header.stamp = ros::Time::now();
  publisher_.publish(message);
  ROS_INFO_STREAM("Serving the atlas '" << folder_ << "': " << atlas->maps.size() << " maps in frame '"
                                        << atlas->frame_id << "'");
}

void AtlasServerRos::lookForChanges() {
  if (stateOfAtlas(folder_) == seen_) return;
  try {
    load();
  } catch (const std::exception& error) {
    ROS_ERROR_STREAM("The atlas has changed and cannot be read, the one before stays: " << error.what());
  }
}

ttsdf_localization::AtlasMapFile AtlasServerRos::fileOf(const AtlasMap& map) const {
  ttsdf_localization::AtlasMapFile file;
  file.info = toMessage(map);
  file.data = readFile(mapPath(folder_, map));
  const std::string id = fileInfo(file.data.data(), file.data.size()).map_id;
  if (id != map.map_id) {
    throw std::runtime_error("map '" + map.name + "': got a file with id " + id + ", wanted " + map.map_id +
                             " as atlas.yaml says");
  }
  return file;
}

bool AtlasServerRos::getDifference(ttsdf_localization::GetDifferentialMap::Request& request,
                                   ttsdf_localization::GetDifferentialMap::Response& response) {
  return answer(response, [&] {
    std::shared_ptr<const Atlas> atlas;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      atlas = atlas_;
    }
    const MapDifference difference = mapDifference(
        *atlas, {request.centre.x, request.centre.y, request.centre.z}, request.radius, request.held_ids);
    std::size_t bytes = 0, left = 0;
    std::string broken;
    for (const std::size_t n : difference.missing) {
      const AtlasMap& map = atlas->maps[n];
      const bool first = response.new_maps.empty();
      if (left > 0 || response.new_maps.size() == kMostMaps || (!first && bytes + map.bytes > kMostBytes)) {
        ++left;
        continue;
      }
      try {
        response.new_maps.push_back(fileOf(map));
        bytes += map.bytes;
      } catch (const std::exception& error) {
        broken += std::string("; ") + error.what();  // the others are of use all the same
      }
    }
    response.drop_ids = difference.dropped;
    response.success = true;
    response.message = std::to_string(response.new_maps.size()) + " new maps" +
                       (left > 0 ? ", " + std::to_string(left) + " more to be asked for" : "") + broken;
  });
}

bool AtlasServerRos::getSelected(ttsdf_localization::GetSelectedMaps::Request& request,
                                 ttsdf_localization::GetSelectedMaps::Response& response) {
  return answer(response, [&] {
    std::shared_ptr<const Atlas> atlas;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      atlas = atlas_;
    }
    if (request.map_ids.size() > kMostMaps) {
      throw std::runtime_error("got " + std::to_string(request.map_ids.size()) + " ids, wanted at most " +
                               std::to_string(kMostMaps));
    }
    std::vector<ttsdf_localization::AtlasMapFile> files;
    std::size_t bytes = 0;
    for (const std::string& id : request.map_ids) {
      const auto map = std::find_if(atlas->maps.begin(), atlas->maps.end(),
                                    [&id](const AtlasMap& one) { return one.map_id == id; });
      if (map == atlas->maps.end()) throw std::runtime_error("got id '" + id + "', which no map has");
      bytes += map->bytes;
      if (bytes > kMostBytes && !files.empty()) {
        throw std::runtime_error("got maps of more than " + std::to_string(kMostBytes) +
                                 " bytes, wanted fewer at once");
      }
      files.push_back(fileOf(*map));
    }
    response.maps = std::move(files);
    response.success = true;
    response.message = std::to_string(response.maps.size()) + " maps";
  });
}

}  // namespace ttsdf
