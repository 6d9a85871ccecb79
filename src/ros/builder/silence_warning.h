#pragma once
// A builder without input looks like one that works: after a while the log says what is missing.

#include <ros/time.h>

#include <string>

#include "ros/builder/posed_cloud_source.h"

namespace ttsdf {

/// Not thread-safe.
class SilenceWarning {
 public:
  /// Warns after `seconds` [s] without a cloud, or without a transform to `frame_id`.
  SilenceWarning(double seconds, std::string frame_id);
  /// Once per silence: a bag that ended is no reason to go on about it.
  void warn(const PosedCloudSource& source);

 private:
  const double seconds_;
  const std::string frame_id_;
  const ros::WallTime start_ = ros::WallTime::now();
  std::string last_;
};

}  // namespace ttsdf
