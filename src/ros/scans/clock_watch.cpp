#include "ros/scans/clock_watch.h"

#include "ros/messages/stamps.h"

namespace ttsdf {

namespace {
constexpr double kClockJitter = 0.1;  // [s] two publishers of /clock, or a nudge by NTP
constexpr double kOldScan = 1.0;      // [s] a single late scan is no jump ...
constexpr int kOldScans = 3;          // ... several in a row are
}  // namespace

bool ClockWatch::clockJumpedBack(const ros::Time& now) {
  const bool jumped_back = secondsBetween(now, last_now_) > kClockJitter;
  last_now_ = now;
  if (jumped_back) {
    newest_stamp_ = ros::Time();
    old_in_row_ = 0;
  }
  return jumped_back;
}

bool ClockWatch::stampsJumpedBack(const ros::Time& stamp) {
  if (stamp.isZero()) return false;
  if (secondsBetween(stamp, newest_stamp_) <= kOldScan) {
    if (stamp > newest_stamp_) newest_stamp_ = stamp;
    old_in_row_ = 0;
    return false;
  }
  if (++old_in_row_ < kOldScans) return false;
  newest_stamp_ = stamp;
  old_in_row_ = 0;
  return true;
}

}  // namespace ttsdf
