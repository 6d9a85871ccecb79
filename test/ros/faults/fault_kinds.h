#pragma once
// The faults of fault_run: their names, how long they last, whether somebody has to say them, and what they
// do to a scan.
//
// A new fault has four places:
//   1. Fault;
//   2. kNames, in the same order;
//   3. mustBeSaid and secondsOf, where "need not be said" and 1 s are wrong for it;
//   4. what it does: damageScan, if it changes a scan; else FaultyRobot (fault_injection.h): begin for
//      what happens once, sendOdometry and sendScan for what happens at every step.

#include <sensor_msgs/PointCloud2.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <iterator>
#include <random>

namespace ttsdf {

enum class Fault {
  kNone,
  kDropScans,
  kDeadCamera,
  kNanStorm,
  kLyingByteOrder,
  kRowStepZero,
  kCutOff,
  kNoise,
  kStampZero,
  kStampAhead,
  kUnknownFrame,
  kDuplicates,
  kReordered,
  kLateScans,
  kLateOdometry,
  kNoOdometry,
  kSlowOdometry,
  kSlowLateOdometry,
  kTransformsTwice,
  kBadTransform,
  kClockBack,
  kClockForward,
  kMapSwap,
  kReset,
  kCount
};
constexpr const char* kNames[] = {"none",
                                  "scans dropped",
                                  "camera dead for 8 s",
                                  "storm of NaN",
                                  "flag of the byte order lies",
                                  "row_step 0",
                                  "data cut off",
                                  "random bytes as points",
                                  "stamp 0",
                                  "stamp 1 h ahead",
                                  "unknown frame",
                                  "scans twice",
                                  "scans in the wrong order",
                                  "scans up to 1 s late",
                                  "odometry up to 1 s late",
                                  "odometry silent for 3 s",
                                  "odometry at 1 Hz",
                                  "odometry at 2 Hz, up to 1 s late",
                                  "transforms twice, old ones last",
                                  "transforms with NaN",
                                  "clock back (loop)",
                                  "clock 30 s forward",
                                  "map swapped",
                                  "reset and new pose"};
static_assert(std::size(kNames) == static_cast<std::size_t>(Fault::kCount), "one name for each fault");
inline const char* nameOf(Fault fault) { return kNames[static_cast<int>(fault)]; }

/// What must be said about it, in a status or in the diagnostics; the others must not be noticed by anybody.
inline bool mustBeSaid(Fault fault) {
  switch (fault) {
    case Fault::kDeadCamera:
    case Fault::kNanStorm:
    case Fault::kCutOff:
    case Fault::kStampZero:
    case Fault::kStampAhead:
    case Fault::kUnknownFrame:
    case Fault::kNoOdometry:
    case Fault::kClockBack:
    case Fault::kMapSwap:
    case Fault::kReset:
    case Fault::kNoise:
      return true;
    default:
      return false;
  }
}
inline double secondsOf(Fault fault) {
  switch (fault) {
    case Fault::kDeadCamera:
      return 8.0;
    case Fault::kNanStorm:
    case Fault::kNoise:
      return 2.0;
    case Fault::kNoOdometry:
    case Fault::kLateOdometry:
    case Fault::kSlowOdometry:
    case Fault::kSlowLateOdometry:
    case Fault::kLateScans:
      return 3.0;
    default:
      return 1.0;
  }
}

/// Those that change the scan itself; the others leave it alone.
inline void damageScan(Fault fault, std::mt19937& random, sensor_msgs::PointCloud2& cloud) {
  const float nan = std::nanf("");
  switch (fault) {
    case Fault::kNanStorm:
      for (std::size_t n = 0; n + 12 <= cloud.data.size(); n += 12) std::memcpy(&cloud.data[n], &nan, 4);
      break;
    case Fault::kLyingByteOrder:
      cloud.is_bigendian = !cloud.is_bigendian;
      break;
    case Fault::kRowStepZero:
      cloud.row_step = 0;
      break;
    case Fault::kCutOff:
      cloud.data.resize(cloud.data.size() - 1 - random() % 1000);
      break;
    case Fault::kNoise:
      for (std::size_t n = 0; n + 4 <= cloud.data.size(); n += 4) {
        const auto value = static_cast<float>(static_cast<double>(random() % 80000) / 10000.0 - 4.0);
        std::memcpy(&cloud.data[n], &value, 4);
      }
      break;
    case Fault::kStampZero:
      cloud.header.stamp = ros::Time();
      break;
    case Fault::kStampAhead:
      cloud.header.stamp += ros::Duration(3600.0);
      break;
    case Fault::kUnknownFrame:
      cloud.header.frame_id = "nowhere";
      break;
    default:
      break;
  }
}

}  // namespace ttsdf
