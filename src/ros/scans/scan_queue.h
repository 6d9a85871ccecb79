#pragma once
// Scans that wait for their transforms: one rule for the node, the map builder and the offline localizer.
//
// A scan can be used as soon as tf gives the pose of its frame in every target frame at its stamp. Odometry
// may be late: a scan waits for it as long as odometry keeps coming. Odometry that falls silent is not waited
// for: scans go on without it. Odometry that never was there is a mistake in the set-up, and no scan goes on
// without it.

#include <ros/time.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>
#include <tf2/buffer_core.h>

#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "ttsdf_localization/registration/registration.h"

namespace ttsdf {

/// A cloud or depth image as soon as it was read. The frame has no leading slash.
struct QueuedScan {
  std_msgs::Header header;
  ScanPoints points;                       ///< reduced; sensor frame [m]
  sensor_msgs::PointCloud2ConstPtr cloud;  ///< the whole of it, for who fuses it
};

/// Thread-safe. Knows no clock: `now` is the caller's, in the clock of the stamps.
class ScanQueue {
 public:
  struct Options {
    std::vector<std::string> targets;  ///< frames that a scan must have
    std::string odometry;              ///< frame that it waits for while it is alive; empty: none
    double odometry_timeout = 0.5;     ///< [s] of silence, after which it is not waited for; 0: always
    std::size_t size = 100;            ///< scans that wait; one more, and the oldest is given up
  };
  struct Taken {
    QueuedScan scan;
    std::string missing;            ///< why it was given up; empty: it can be used
    bool without_odometry = false;  ///< it goes on though its odometry is missing
    bool overtaken = false;  ///< it could have been used, but newer ones came faster than they were taken
  };

  /// `buffer` must outlive the queue.
  ScanQueue(Options options, const tf2::BufferCore& buffer);

  void put(QueuedScan scan, const ros::Time& now);
  /// The oldest scan that can be used, or one that is given up; empty: none of both. `newest`: of those that
  /// can be used, the newest, and the others are overtaken. `at_end`: nothing more will come, so that nothing
  /// waits.
  std::optional<Taken> take(const ros::Time& now, bool newest = false, bool at_end = false);
  /// Forgets the scans and what is known about odometry.
  void clear();

  bool empty() const;
  /// "; no transform 'camera' -> 'odom' at the scan's stamp: ..." for the newest scan that waits; empty: none
  /// does.
  std::string whyWaiting() const;

 private:
  struct Waiting {
    QueuedScan scan;
    ros::Time arrival;
  };
  enum class Ready { kYes, kWithoutOdometry, kNo, kNever };

  bool hasTransform(const QueuedScan& scan, const std::string& target, std::string* why) const;
  Ready readiness(const Waiting& waiting, const ros::Time& now, bool at_end) const;
  void watchOdometry(const ros::Time& now);
  bool isTooOld(const QueuedScan& scan) const;
  bool odometryIsSilent(const ros::Time& now) const;
  std::string why(const QueuedScan& scan) const;

  const Options options_;
  const tf2::BufferCore& buffer_;
  mutable std::mutex mutex_;
  std::deque<Waiting> waiting_;  ///< by stamp
  std::deque<Taken> given_up_;
  ros::Time newest_odometry_, odometry_seen_;  ///< its stamp, and when it last rose; zero: never
  std::deque<double> odometry_gaps_;           ///< [s] between the last few rises
};

}  // namespace ttsdf
