#include <algorithm>
#include <chrono>
#include <cmath>

#include "../result.h"
#include "multi_start.h"
#include "start_poses.h"
#include "ttsdf_localization/registration/search.h"

namespace ttsdf {

const OptionTable<GlobalOptions>& globalOptionTable() {
  using O = GlobalOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("starts", &O::starts, 1, 10000000, "",
               "Starts over the free space with gravity known; up to 32 times as many where it is "
               "large for what the scan shows")
          .add("starts_without_gravity", &O::starts_without_gravity, 1, 10000000, "",
               "Starts without that hint")
          .add("coarse_points", &O::coarse_points, 6, 100000, "", "Points of the cheap descents")
          .add("refined", &O::refined, 1, 10000, "", "Best starts that are refined on all points")
          .add("tilt_sigma", &O::tilt_sigma, 0.0, 3.2, "rad", "Trust in the gravity hint")
          .add("min_margin", &O::min_margin, 0.0, 1.0, "",
               "The best other place must score worse by this much")
          .add("max_score", &O::max_score, 0.0, 1.0, "",
               "A worse best score is refused; seeing through walls counts")
          .add("min_confidence", &O::min_confidence, 0.0, 1.0, "",
               "Least confidence of the verification: a pose out of nowhere has to show more")
          .add("threads", &O::threads, 1, 64, "", "Threads")
          .add("seed", &O::seed, 0, 2147483647, "", "Seed of the starts");
  return table;
}

namespace {

using Clock = std::chrono::steady_clock;
double secondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

constexpr double kFirst = 0.5;      // widest kernel, in radii of the scan
constexpr double kKeptPart = 0.35;  // of the starts, after a few steps
constexpr int kRetries = 16;        // in the map, from around a place that explains the scan
constexpr double kCells = 20.0;  // of a scan's radius cubed, in free space that `starts` are enough for ...
constexpr double kMostTimes = 32.0;   // ... more of it takes more of them, at most so many times
constexpr int kMostStarts = 1000000;  // 128 MB of them; more where the options ask for more
constexpr double kSure = 0.15;        // a place that explains the scan so well needs no further starts
constexpr int kFurther = 1;           // times as many starts once more, where the first ones did not do

void applyThresholds(const GlobalOptions& options, RegistrationResult& best) {
  if (best.reason == TerminationReason::kTooFewPoints) return;
  if (totalScore(best) > options.max_score) {
    best.success = false;
    best.reason = TerminationReason::kLowScore;
  } else if (!best.success) {
    return;  // for the reason it gives
  } else if (best.confidence < options.min_confidence) {
    best.success = false;
    best.reason = TerminationReason::kUnsure;
  } else if (best.runner_up_score - totalScore(best) < options.min_margin) {
    best.success = false;
    best.reason = TerminationReason::kAmbiguous;
  }
}

}  // namespace

RegistrationResult localizeGlobally(Registration& registration, const ScanPoints& points,
                                    const std::optional<Eigen::Vector3d>& gravity,
                                    const Eigen::Vector3d& map_down, const GlobalOptions& options,
                                    const ProgressCallback& progress) {
  const auto begin = Clock::now();
  globalOptionTable().validate(options);
  RegistrationResult best;
  const MultiStart search(registration, points, options.coarse_points);
  best.points = search.points();
  if (best.points < registration.options().min_points) return best;
  std::optional<GravityHint> hint;
  if (gravity) hint = GravityHint{gravity->normalized(), map_down.normalized(), options.tilt_sigma};
  const double volume = freeVolume(registration.field(), search.coarse(), search.clearance(), options.seed);
  const double cells = volume / std::max(std::pow(search.radius(), 3), 1e-9);
  const int asked = gravity ? options.starts : options.starts_without_gravity;
  const int first_starts = static_cast<int>(
      std::min(asked * std::clamp(cells / kCells, 1.0, kMostTimes), std::max<double>(asked, kMostStarts)));
  const auto startsUpTo = [&](int count) {
    return startsOverMap(registration.field(), search.coarse(), hint, search.clearance(), count,
                         options.seed);
  };
  bool cancelled = false;
  double begun = 0.0, part = 1.0 / (1 + kFurther);  // of all the work that there may be
  const auto keepGoing = [&](double share) {
    if (!cancelled && progress && !progress(begun + part * share)) cancelled = true;
    return !cancelled;
  };
  MultiStart::Options wide;
  wide.first = kFirst;
  wide.kept_part = kKeptPart;
  wide.refined = static_cast<std::size_t>(options.refined);
  wide.retries = kRetries;
  wide.threads = options.threads;
  std::vector<Eigen::Isometry3d> found;
  const auto descendFrom = [&](const std::vector<Eigen::Isometry3d>& starts) {
    const auto more = search.places(starts, wide, keepGoing);
    found.insert(found.end(), more.begin(), more.end());
    if (!found.empty())
      best = registration.alignFrom(points, found, PosePrior{found.front(), Matrix6d::Zero()});
    applyThresholds(options, best);
  };
  best.reason = TerminationReason::kLowScore;  // if no start came through
  std::vector<Eigen::Isometry3d> starts = startsUpTo(first_starts);
  descendFrom(starts);
  if (!cancelled && !(best.success && totalScore(best) <= kSure)) {
    begun = part, part = 1.0 - begun;
    std::vector<Eigen::Isometry3d> more = startsUpTo((1 + kFurther) * first_starts);
    more.erase(more.begin(),
               more.begin() + static_cast<std::ptrdiff_t>(std::min(more.size(), starts.size())));
    descendFrom(more);
  }
  if (cancelled) {
    best.success = false;
    best.reason = TerminationReason::kCancelled;
  }
  best.milliseconds = 1e3 * secondsSince(begin);
  return best;
}

}  // namespace ttsdf
