#include "ros/messages/stamps.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iomanip>
#include <limits>
#include <sstream>

namespace ttsdf {

namespace {
constexpr double kNanosecond = 1e-9;             // [s]
constexpr std::int64_t kPerSecond = 1000000000;  // nanoseconds
constexpr double kLargest = 4294967295.0;        // [s] that ros::Time holds
/// [s] what a ros::Duration holds, less what tf2 adds to stamps (its cache of 10 s).
constexpr double kFarthest = 2147483647.0 - 100.0;
}  // namespace

double secondsBetween(const ros::Time& from, const ros::Time& to) {
  return static_cast<double>(to.sec) - static_cast<double>(from.sec) +
         kNanosecond * (static_cast<double>(to.nsec) - static_cast<double>(from.nsec));
}

ros::Time addSeconds(const ros::Time& time, double seconds) {
  const double limited = std::clamp(std::isnan(seconds) ? 0.0 : seconds, -2.0 * kLargest, 2.0 * kLargest);
  const double whole = std::floor(limited);
  const std::int64_t nanoseconds =
      time.nsec + static_cast<std::int64_t>(std::llround((limited - whole) / kNanosecond));
  const std::int64_t sum = time.sec + static_cast<std::int64_t>(whole) + nanoseconds / kPerSecond;
  if (sum < 0) return ros::TIME_MIN;
  if (sum > std::numeric_limits<std::uint32_t>::max()) return ros::TIME_MAX;
  return {static_cast<std::uint32_t>(sum), static_cast<std::uint32_t>(nanoseconds % kPerSecond)};
}

ros::Time toTime(double seconds) { return addSeconds(ros::Time(), seconds); }

std::string stampProblem(const ros::Time& stamp, const ros::Time& now) {
  const double ahead = secondsBetween(now, stamp);
  if (std::abs(ahead) <= kFarthest) return {};
  std::ostringstream text;
  text << "the stamp " << stamp << " lies " << std::fixed << std::setprecision(1) << std::abs(ahead) << " s "
       << (ahead > 0.0 ? "after" : "before") << " now, " << now << ", at most " << kFarthest << " s allowed";
  return text.str();
}

}  // namespace ttsdf
