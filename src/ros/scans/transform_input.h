#pragma once
// /tf and /tf_static in. Not tf2's listener: that has its own idea of time jumps, and nobody is told when a
// transform came.

#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <tf2_msgs/TFMessage.h>

#include <exception>
#include <functional>
#include <utility>

namespace ttsdf {

class TransformInput {
 public:
  using Callback =
      std::function<void(const tf2_msgs::TFMessage& message, const std::string& authority, bool is_static)>;

  /// Callbacks run in the queue of `node`.
  TransformInput(ros::NodeHandle& node, Callback callback) : callback_(std::move(callback)) {
    const auto handler = [this](bool is_static) {
      return boost::function<void(const ros::MessageEvent<const tf2_msgs::TFMessage>&)>(
          [this, is_static](const ros::MessageEvent<const tf2_msgs::TFMessage>& event) {
            try {
              callback_(*event.getConstMessage(), event.getPublisherName(), is_static);
            } catch (const std::exception& error) {
              ROS_ERROR_STREAM_THROTTLE(
                  5.0, "a transform from " << event.getPublisherName() << " was refused: " << error.what());
            }
          });
    };
    using Event = const ros::MessageEvent<const tf2_msgs::TFMessage>&;
    const ros::TransportHints hints = ros::TransportHints().tcpNoDelay();
    moving_ =
        node.subscribe<tf2_msgs::TFMessage, Event>("/tf", 100, handler(false), ros::VoidConstPtr(), hints);
    fixed_ = node.subscribe<tf2_msgs::TFMessage, Event>("/tf_static", 100, handler(true), ros::VoidConstPtr(),
                                                        hints);
  }
  void shutdown() {
    moving_.shutdown();
    fixed_.shutdown();
  }

 private:
  const Callback callback_;
  ros::Subscriber moving_, fixed_;
};

}  // namespace ttsdf
