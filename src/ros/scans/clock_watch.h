#pragma once
// Notices when time goes back: a bag that loops, a simulation that is reset.

#include <ros/time.h>

namespace ttsdf {

/// Not thread-safe.
class ClockWatch {
 public:
  /// Call often. True if the clock is behind the last call by more than jitter.
  bool clockJumpedBack(const ros::Time& now);
  /// Call per scan. True after several scans in a row far older than the newest one: a bag replayed without
  /// its clock.
  bool stampsJumpedBack(const ros::Time& stamp);

 private:
  ros::Time last_now_, newest_stamp_;
  int old_in_row_ = 0;
};

}  // namespace ttsdf
