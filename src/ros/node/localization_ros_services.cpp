// Services. Every reply says whether it worked and why; no exception leaves.

#include <utility>

#include "ros/maps/service_answer.h"
#include "ros/node/localization_ros.h"
#include "ttsdf_localization/files/file_writer.h"

namespace ttsdf {

void LocalizationRos::advertise() {
  using Self = LocalizationRos;
  services_ = {service_node_.advertiseService("get_map", &Self::getMap, this),
               service_node_.advertiseService("load_map", &Self::loadMap, this),
               service_node_.advertiseService("set_map", &Self::setMap, this),
               service_node_.advertiseService("relocalize", &Self::relocalize, this),
               service_node_.advertiseService("global_localization", &Self::globalLocalization, this),
               service_node_.advertiseService("pause", &Self::pause, this),
               service_node_.advertiseService("reset", &Self::reset, this),
               service_node_.advertiseService("request_nomotion_update", &Self::requestUpdate, this)};
}

bool LocalizationRos::getMap(ttsdf_localization::GetMap::Request& /*request*/,
                             ttsdf_localization::GetMap::Response& response) {
  return answer(response, [&] {
    response.map = pipeline_.map();
    response.message = "map " + response.map.map_id;
    response.success = true;
  });
}

bool LocalizationRos::loadMap(ttsdf_localization::LoadMap::Request& request,
                              ttsdf_localization::LoadMap::Response& response) {
  return answer(response, [&] {
    const std::string file = options_.map.map_folder.empty()
                                 ? request.filename
                                 : pathInFolder("filename", request.filename, options_.map.map_folder);
    const std::lock_guard<std::mutex> lock(load_mutex_);
    LoadedMap map = map_source_->prepareFile(file);
    response.map_id = map.map_id;
    response.message = map.summary;
    pipeline_.useMap(std::move(map));
    response.success = true;
  });
}

bool LocalizationRos::setMap(ttsdf_localization::SetMap::Request& request,
                             ttsdf_localization::SetMap::Response& response) {
  return answer(response, [&] {
    std::optional<PoseRequest> pose;
    if (request.use_initial_pose)
      pose = readPose(request.initial_pose, pipeline_.buffer(), options_.frames, "set_map", ros::Time::now());
    const std::lock_guard<std::mutex> lock(load_mutex_);
    LoadedMap map = map_source_->prepare(request.map.data);
    response.map_id = map.map_id;
    response.message = map.summary;
    pipeline_.useMap(std::move(map), std::move(pose));
    response.success = true;
  });
}

bool LocalizationRos::relocalize(ttsdf_localization::Relocalize::Request& request,
                                 ttsdf_localization::Relocalize::Response& response) {
  return answer(response, [&] {
    std::optional<PoseRequest> around;
    if (!request.use_last_pose)
      around = readPose(request.pose, pipeline_.buffer(), options_.frames, "relocalize", ros::Time::now());
    pipeline_.relocalize(around, response);
  });
}

bool LocalizationRos::globalLocalization(ttsdf_localization::GlobalLocalization::Request& request,
                                         ttsdf_localization::GlobalLocalization::Response& response) {
  return answer(response, [&] { pipeline_.globalLocalization(request, response); });
}

bool LocalizationRos::pause(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response) {
  return answer(response, [&] {
    paused_ = request.data;
    pipeline_.setPaused(request.data);
    response.success = true;
    response.message = request.data ? "paused" : "running";
  });
}

bool LocalizationRos::reset(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  return answer(response, [&] {
    pipeline_.reset(poseAtStart());
    response.success = true;
    response.message = "the pose is forgotten, the map is kept";
  });
}

bool LocalizationRos::requestUpdate(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  pipeline_.requestUpdate();
  return true;
}

}  // namespace ttsdf
