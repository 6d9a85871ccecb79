// Services. Every reply says whether it worked and why; no exception leaves.

#include <stdexcept>
#include <utility>

#include "ttsdf_localization/ros/conversions.h"
#include "ttsdf_localization/ros/localization_ros.h"
#include "ttsdf_localization/ros/service_answer.h"

namespace ttsdf {

void LocalizationRos::advertise() {
  services_ = {
      service_node_.advertiseService("get_map", &LocalizationRos::getMap, this),
      service_node_.advertiseService("load_map", &LocalizationRos::loadMap, this),
      service_node_.advertiseService("set_map", &LocalizationRos::setMap, this),
      service_node_.advertiseService("relocalize", &LocalizationRos::relocalize, this),
      service_node_.advertiseService("global_localization", &LocalizationRos::globalLocalization, this),
      service_node_.advertiseService("pause", &LocalizationRos::pause, this),
      service_node_.advertiseService("reset", &LocalizationRos::reset, this)};
}

bool LocalizationRos::getMap(ttsdf_localization::GetMap::Request& /*request*/,
                             ttsdf_localization::GetMap::Response& response) {
  return answer(response, [&] {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!map_message_) throw std::runtime_error("no map");
      response.map = *map_message_;
    }
    response.map.header.frame_id = options_.frames.global_frame_id;
    response.map.header.stamp = ros::Time::now();
    response.message = "map " + response.map.map_id;
    response.success = true;
  });
}

bool LocalizationRos::loadMap(ttsdf_localization::LoadMap::Request& request,
                              ttsdf_localization::LoadMap::Response& response) {
  return answer(response, [&] {
    LoadedMap map = map_source_->prepareFile(request.filename);
    response.map_id = map.map_id;
    response.message = map.summary;
    putMapIntoUse(std::move(map));
    response.success = true;
  });
}

bool LocalizationRos::setMap(ttsdf_localization::SetMap::Request& request,
                             ttsdf_localization::SetMap::Response& response) {
  return answer(response, [&] {
    std::optional<PoseRequest> pose;
    if (request.use_initial_pose)
      pose = readPose(request.initial_pose, tf_buffer_, options_.frames, "set_map");
    LoadedMap map = map_source_->prepare(request.map.data);
    response.map_id = map.map_id;
    response.message = map.summary;
    putMapIntoUse(std::move(map));
    if (pose) usePose(std::move(*pose));
    response.success = true;
  });
}

bool LocalizationRos::relocalize(ttsdf_localization::Relocalize::Request& request,
                                 ttsdf_localization::Relocalize::Response& response) {
  return answer(response, [&] {
    std::optional<PoseRequest> wanted;
    if (!request.use_last_pose) wanted = readPose(request.pose, tf_buffer_, options_.frames, "relocalize");
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!localizer_.hasMap()) throw std::runtime_error("no map");
    if (!newest_scan_) throw std::runtime_error("no scan yet to relocalize with");
    const std::optional<PoseGuess> last = localizer_.lastPose();
    if (!wanted && !last) throw std::runtime_error("there is no last pose");
    global_worker_->cancel();
    ++orders_;
    pose_request_.reset();
    const PoseGuess guess = wanted ? withOdometry(*wanted, tf_buffer_, options_.frames) : *last;
    const LocalizationUpdate update = localizer_.relocalize(newest_scan_->scan, guess);
    publishUpdate(update, *newest_scan_);
    response.success = update.relocalized;
    response.message = update.message;
    response.score = update.registration.score;
    if (update.relocalized) response.pose = output_.poseMessage(update, newest_scan_->header.stamp);
  });
}

bool LocalizationRos::pause(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response) {
  return answer(response, [&] {
    paused_ = request.data;
    response.success = true;
    response.message = request.data ? "paused" : "running";
    const std::lock_guard<std::mutex> lock(mutex_);
    Status status;
    status.state = statusState(localizer_.state());
    status.message = response.message;
    publishStatus(std::move(status), std_msgs::Header());
  });
}

bool LocalizationRos::reset(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  return answer(response, [&] {
    global_worker_->cancel();
    tf_output_.stop();
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ++epoch_;
      ++orders_;
      newest_scan_.reset();
      pose_request_.reset();
      localizer_.reset();
      output_.clearPath();
      Status status;
      status.state = statusState(localizer_.state());
      status.message = "reset";
      publishStatus(std::move(status), std_msgs::Header());
    }
    applyStartPose();
    response.success = true;
    response.message = "the pose is forgotten, the map is kept";
  });
}

}  // namespace ttsdf
