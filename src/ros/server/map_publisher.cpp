#include "ros/server/map_publisher.h"

#include <utility>

#include "ros/messages/conversions.h"
#include "ttsdf_localization/map/map_io.h"

namespace ttsdf {

MapPublisher::MapPublisher(ros::NodeHandle nh)
    : publisher_(nh.advertise<ttsdf_localization::TtSdfMap>("ttsdf_map", 1, true)),
      service_(nh.advertiseService("get_map", &MapPublisher::getMap, this)) {}

std::string MapPublisher::set(std::vector<std::uint8_t> bytes) {
  auto held = std::make_shared<Held>();
  held->map = std::make_shared<TtSdfMap>(deserialize(bytes.data(), bytes.size()));
  held->message = toMapMessage(*held->map, std::move(bytes), held->map->frame_id);
  held->message.header.stamp = ros::Time::now();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    held_ = held;
  }
  publisher_.publish(held->message);
  return held->message.map_id;
}

std::shared_ptr<const MapPublisher::Held> MapPublisher::held() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return held_;
}

bool MapPublisher::getMap(ttsdf_localization::GetMap::Request& /*request*/,
                          ttsdf_localization::GetMap::Response& response) {
  const auto held = this->held();
  response.success = held != nullptr;
  if (held) {
    response.map = held->message;
    response.map.header.stamp = ros::Time::now();
    response.message = "map " + response.map.map_id;
  } else {
    response.message = "no map: none was built or loaded yet";
  }
  return true;
}

}  // namespace ttsdf
