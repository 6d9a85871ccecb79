#pragma once
// Transforms into a tf2 buffer, one rule for localizer and map builder: a stamp that tf2 cannot compare with
// the others would make it throw at every later look-up, so that transform is left out.

#include <geometry_msgs/TransformStamped.h>
#include <ros/time.h>
#include <tf2/buffer_core.h>

#include <string>

namespace ttsdf {

struct AddedTransform {
  bool taken = false;    ///< false without `left_out`: tf2 refused it, for being too old, say
  std::string left_out;  ///< why it was left out; empty: it was not
};

/// `now`: the clock, zero: not known yet. Never throws.
AddedTransform addTransform(tf2::BufferCore& buffer, const geometry_msgs::TransformStamped& transform,
                            const std::string& authority, bool is_static, const ros::Time& now);

}  // namespace ttsdf
