#pragma once
// Sends map -> odom (or map -> base) again and again with stamps that only ever rise: consumers never wait
// for the next scan, and tf never sees the same stamp twice.

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/time.h>

#include <mutex>
#include <optional>
#include <string>

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

/// Thread-safe. Knows no clock: the caller says what time it is.
class TfOutput {
 public:
  struct Options {
    std::string parent, child;
    double tolerance = 0.1;          ///< stamps lie this far ahead of the scan [s]
    double rate = 30.0;              ///< [Hz]
    bool extrapolate = false;        ///< map -> base: move on with the twist between scans ...
    double max_extrapolation = 0.5;  ///< ... for at most this time, then fall silent [s]
  };

  /// Publishes on /tf through `node`, so that remappings of a nodelet hold.
  TfOutput(ros::NodeHandle& node, Options options);

  /// A new transform, true at `scan_stamp`; sent at once if that keeps the stamps rising. `twist`: of the
  /// child, in its own frame [rad/s; m/s].
  void update(const Eigen::Isometry3d& T_parent_child, const Vector6d& twist, const ros::Time& scan_stamp,
              const ros::Time& now);
  /// Nothing is sent until the next update.
  void stop();
  /// Sends the last transform again, stamped as far on as time has gone on. Call at `rate` or faster.
  void tick(const ros::Time& now);
  /// The clock went back: smaller stamps are right again.
  void timeJumpedBack();

  /// From the next transform on; stamps rise all the same.
  void setTiming(double tolerance, double rate, double max_extrapolation);

  /// A transform is in use and is still sent again and again.
  bool isSending(const ros::Time& now) const;
  /// Stamp of the last transform sent; zero if none was.
  ros::Time lastStamp() const;

 private:
  void send(const Eigen::Isometry3d& T_parent_child, const ros::Time& stamp);

  ros::Publisher publisher_;
  mutable std::mutex mutex_;
  Options options_;
  std::optional<Eigen::Isometry3d> T_parent_child_;
  Vector6d twist_ = Vector6d::Zero();
  ros::Time scan_stamp_, updated_, last_stamp_, last_sent_;
};

}  // namespace ttsdf
