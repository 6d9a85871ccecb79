#include <nodelet/nodelet.h>

#include <exception>
#include <memory>
#include <pluginlib/class_list_macros.hpp>

#include "ros/builder/map_builder_ros.h"

namespace ttsdf_localization {

/// The same class as map_builder_node; a bad parameter leaves the manager alive and this nodelet idle.
class MapBuilderNodelet : public nodelet::Nodelet {
 private:
  void onInit() override {
    try {
      builder_ = std::make_unique<ttsdf::MapBuilderRos>(getNodeHandle(), getPrivateNodeHandle());
    } catch (const std::exception& error) {
      NODELET_FATAL_STREAM("Map builder not started: " << error.what());
      start_error_ = ttsdf::publishBuilderStartError(getPrivateNodeHandle(), error.what());
    }
  }

  std::unique_ptr<ttsdf::MapBuilderRos> builder_;
  ros::Publisher start_error_;
};

}  // namespace ttsdf_localization

PLUGINLIB_EXPORT_CLASS(ttsdf_localization::MapBuilderNodelet, nodelet::Nodelet)
