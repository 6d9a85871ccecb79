#include "ros/scans/transform_buffer.h"

#include <exception>

#include "ros/messages/stamps.h"

namespace ttsdf {

AddedTransform addTransform(tf2::BufferCore& buffer, const geometry_msgs::TransformStamped& transform,
                            const std::string& authority, bool is_static, const ros::Time& now) {
  AddedTransform added;
  std::string problem;
  if (!is_static) problem = stampProblem(transform.header.stamp, now);  // nobody reads a static one's stamp
  if (problem.empty()) {
    try {
      added.taken = buffer.setTransform(transform, authority, is_static);
      return added;
    } catch (const std::exception& error) {
      problem = error.what();
    }
  }
  added.left_out =
      "transform '" + transform.header.frame_id + "' -> '" + transform.child_frame_id + "': " + problem;
  return added;
}

}  // namespace ttsdf
