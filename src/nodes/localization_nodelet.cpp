#include <nodelet/nodelet.h>

#include <memory>
#include <pluginlib/class_list_macros.hpp>

#include "ros/node/localization_ros.h"

namespace ttsdf_localization {

/// LocalizationRos in a nodelet manager: clouds of nodelets beside it come without a copy.
class LocalizationNodelet : public nodelet::Nodelet {
  void onInit() override {
    try {
      localization_ =
          std::make_unique<ttsdf::LocalizationRos>(getNodeHandle(), getPrivateNodeHandle(), getName());
    } catch (const std::exception& error) {
      NODELET_FATAL_STREAM("does not start: " << error.what());
      // The manager and its other nodelets live on.
      start_error_ = ttsdf::publishStartError(getNodeHandle(), error.what());
    }
  }

  std::unique_ptr<ttsdf::LocalizationRos> localization_;
  ros::Publisher start_error_;
};

}  // namespace ttsdf_localization

PLUGINLIB_EXPORT_CLASS(ttsdf_localization::LocalizationNodelet, nodelet::Nodelet)
