#include "ros/scans/scan_queue.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "ros/messages/stamps.h"
#include "ttsdf_localization/geometry/median.h"

namespace ttsdf {

namespace {
constexpr double kPatience = 2.5;       // [s] that a scan waits for a transform
constexpr std::size_t kGapsKept = 5;    // of odometry, whose median is its usual period
constexpr double kSilentPeriods = 2.5;  // odometry that misses so many of its periods is silent
}  // namespace

ScanQueue::ScanQueue(Options options, const tf2::BufferCore& buffer)
    : options_(std::move(options)), buffer_(buffer) {}

void ScanQueue::put(QueuedScan scan, const ros::Time& now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  watchOdometry(now);
  if (waiting_.size() >= options_.size) {
    Taken oldest;
    oldest.scan = std::move(waiting_.front().scan);
    waiting_.pop_front();
    oldest.missing = why(oldest.scan);
    oldest.overtaken = oldest.missing.empty();
    if (!oldest.overtaken) oldest.missing = "its transforms did not come in time" + oldest.missing;
    given_up_.push_back(std::move(oldest));
    if (given_up_.size() > options_.size) given_up_.pop_front();
  }
  const auto later = std::find_if(waiting_.begin(), waiting_.end(), [&](const Waiting& other) {
    return other.scan.header.stamp > scan.header.stamp;
  });
  waiting_.insert(later, {std::move(scan), now});
}

std::optional<ScanQueue::Taken> ScanQueue::take(const ros::Time& now, bool newest, bool at_end) {
  const std::lock_guard<std::mutex> lock(mutex_);
  watchOdometry(now);
  if (given_up_.empty() && newest) {
    // What is passed over was good, only too slow to be worked on.
    auto last = waiting_.end();
    for (auto it = waiting_.begin(); it != waiting_.end(); ++it) {
      const Ready ready = readiness(*it, now, at_end);
      if (ready == Ready::kYes || ready == Ready::kWithoutOdometry) last = it;
    }
    if (last != waiting_.end()) {
      for (auto it = waiting_.begin(); it != last; ++it)
        given_up_.push_back({std::move(it->scan), "", false, true});
      waiting_.erase(waiting_.begin(), last);
    }
  }
  if (!given_up_.empty()) {
    Taken taken = std::move(given_up_.front());
    given_up_.pop_front();
    return taken;
  }
  for (auto it = waiting_.begin(); it != waiting_.end(); ++it) {
    const Ready ready = readiness(*it, now, at_end);
    if (ready == Ready::kNo) continue;
    Taken taken;
    if (ready == Ready::kNever) taken.missing = "its transforms did not come in time" + why(it->scan);
    taken.without_odometry = ready == Ready::kWithoutOdometry;
    taken.scan = std::move(it->scan);
    waiting_.erase(it);
    return taken;
  }
  return std::nullopt;
}

void ScanQueue::clear() {
  const std::lock_guard<std::mutex> lock(mutex_);
  waiting_.clear();
  given_up_.clear();
  newest_odometry_ = odometry_seen_ = ros::Time();
  odometry_gaps_.clear();
}

bool ScanQueue::empty() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return waiting_.empty() && given_up_.empty();
}

std::string ScanQueue::whyWaiting() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return waiting_.empty() ? std::string() : why(waiting_.back().scan);
}

bool ScanQueue::hasTransform(const QueuedScan& scan, const std::string& target, std::string* why) const {
  try {
    return buffer_.canTransform(target, scan.header.frame_id, scan.header.stamp, why);
  } catch (const std::exception& error) {  // tf2 says how far stamps are apart, and cannot for some
    if (why) *why = error.what();
    return false;
  }
}

ScanQueue::Ready ScanQueue::readiness(const Waiting& waiting, const ros::Time& now, bool at_end) const {
  const bool late = at_end || secondsBetween(waiting.arrival, now) >= kPatience;
  const bool complete =
      std::all_of(options_.targets.begin(), options_.targets.end(),
                  [&](const std::string& target) { return hasTransform(waiting.scan, target, nullptr); });
  if (!complete) return late || isTooOld(waiting.scan) ? Ready::kNever : Ready::kNo;
  if (options_.odometry.empty() || hasTransform(waiting.scan, options_.odometry, nullptr)) return Ready::kYes;
  const bool may_go_on = !odometry_seen_.isZero() && options_.odometry_timeout > 0.0;
  if (may_go_on && (late || odometryIsSilent(now))) return Ready::kWithoutOdometry;
  return late || isTooOld(waiting.scan) ? Ready::kNever : Ready::kNo;
}

void ScanQueue::watchOdometry(const ros::Time& now) {
  if (options_.odometry.empty() || options_.targets.empty()) return;
  const std::string& base = options_.targets.front();
  ros::Time newest;
  try {
    newest = buffer_.lookupTransform(options_.odometry, base, ros::Time(0)).header.stamp;
  } catch (const std::exception&) {
    return;  // never there, or forgotten
  }
  // A transform that never changes has stamp 0: it is always there, and never late.
  if (newest.isZero() || newest <= newest_odometry_) return;
  if (!odometry_seen_.isZero()) {
    odometry_gaps_.push_back(secondsBetween(odometry_seen_, now));
    if (odometry_gaps_.size() > kGapsKept) odometry_gaps_.pop_front();
  }
  newest_odometry_ = newest;
  odometry_seen_ = now;
}

bool ScanQueue::isTooOld(const QueuedScan& scan) const {
  return secondsBetween(scan.header.stamp, newest_odometry_) > tf2::BufferCore::DEFAULT_CACHE_TIME;
}

bool ScanQueue::odometryIsSilent(const ros::Time& now) const {
  double limit = options_.odometry_timeout;
  if (!odometry_gaps_.empty()) {
    // Odometry that comes once a second is not silent after half a second.
    std::vector<double> gaps(odometry_gaps_.begin(), odometry_gaps_.end());
    limit = std::max(limit, std::min(kSilentPeriods * upperMedian(gaps), kPatience));
  }
  return secondsBetween(odometry_seen_, now) >= limit;
}

std::string ScanQueue::why(const QueuedScan& scan) const {
  if (isTooOld(scan)) return "; the scan is older than the transforms kept";
  std::vector<std::string> targets = options_.targets;
  if (!options_.odometry.empty()) targets.push_back(options_.odometry);
  for (const std::string& target : targets) {
    std::string why;
    if (!hasTransform(scan, target, &why)) {
      return "; no transform '" + scan.header.frame_id + "' -> '" + target + "' at the scan's stamp: " + why;
    }
  }
  return {};
}

}  // namespace ttsdf
