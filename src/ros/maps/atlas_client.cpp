#include "ros/maps/atlas_client.h"

#include <ros/connection.h>
#include <ros/service.h>
#include <ros/service_manager.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <future>
#include <stdexcept>
#include <utility>

#include "ros/maps/atlas_messages.h"

namespace ttsdf {

AtlasClient::AtlasClient(ros::NodeHandle& node, double timeout, Changed changed, Failed failed)
    : timeout_(timeout),
      changed_(std::move(changed)),
      failed_(std::move(failed)),
      service_(node.resolveName("get_selected_maps")),
      subscriber_(node.subscribe("atlas", 1, &AtlasClient::onAtlas, this)) {}

void AtlasClient::stop() {
  subscriber_.shutdown();
  const std::lock_guard<std::mutex> lock(mutex_);
  stopped_ = true;
  for (const auto& link : links_) link->getConnection()->drop(ros::Connection::Destructing);
}

void AtlasClient::onAtlas(const ttsdf_localization::AtlasInfoConstPtr& message) {
  try {
    changed_(fromMessage(*message), message->places);
  } catch (const std::exception& error) {
    failed_(std::string("the server's atlas cannot be used: ") + error.what());
  }
}

std::vector<std::uint8_t> AtlasClient::fetch(const AtlasMap& map) {
  ttsdf_localization::GetSelectedMaps selected;
  selected.request.map_ids = {map.map_id};
  call(selected);
  if (!selected.response.success)
    throw std::runtime_error("service '" + service_ + "': " + selected.response.message);
  if (selected.response.maps.size() != 1) {
    throw std::runtime_error("service '" + service_ + "': got " +
                             std::to_string(selected.response.maps.size()) + " maps, wanted 1");
  }
  return std::move(selected.response.maps.front().data);
}

void AtlasClient::call(ttsdf_localization::GetSelectedMaps& call) {
  if (!ros::service::exists(service_, false))
    throw std::runtime_error("service '" + service_ + "' is not there");
  // Not ros::service::call: nothing could end that while the other side hangs.
  const ros::ServiceServerLinkPtr link = ros::ServiceManager::instance()->createServiceServerLink(
      service_, true, ros::service_traits::md5sum(call), ros::service_traits::md5sum(call), {});
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!link || stopped_) throw std::runtime_error("service '" + service_ + "' could not be called");
    links_.push_back(link);
  }
  ros::SerializedMessage reply;
  std::future<bool> answer = std::async(std::launch::async, [&] {
    return link->call(ros::serialization::serializeMessage(call.request), reply);
  });
  const bool in_time = answer.wait_for(std::chrono::duration<double>(timeout_)) == std::future_status::ready;
  link->getConnection()->drop(ros::Connection::Destructing);  // ends a call that hangs
  const bool answered = answer.get();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    links_.erase(std::find(links_.begin(), links_.end(), link));
  }
  if (!in_time) {
    throw std::runtime_error("service '" + service_ + "': got no answer within " + std::to_string(timeout_) +
                             " s (atlas_timeout)");
  }
  if (!answered) throw std::runtime_error("service '" + service_ + "' could not be called");
  ros::serialization::deserializeMessage(reply, call.response);
}

}  // namespace ttsdf
