#include "ros/builder/silence_warning.h"

#include <ros/console.h>

#include <algorithm>
#include <utility>

namespace ttsdf {

SilenceWarning::SilenceWarning(double seconds, std::string frame_id)
    : seconds_(seconds), frame_id_(std::move(frame_id)) {}

void SilenceWarning::warn(const PosedCloudSource& source) {
  const auto input = source.counts();
  const auto age = [this](const ros::WallTime& time) {
    return (ros::WallTime::now() - std::max(time, start_)).toSec();
  };
  std::string warning;
  if (age(input.last_received) > seconds_) {
    warning = "no cloud on " + source.topic();
  } else if (age(input.last_transformed) > seconds_) {
    warning = "clouds come in, but there is no transform from '" + input.sensor_frame_id + "' to '" +
              frame_id_ + "' at their stamps";
  }
  if (!warning.empty() && warning != last_) ROS_WARN_STREAM("Since " << seconds_ << " s: " << warning);
  last_ = warning;
}

}  // namespace ttsdf
