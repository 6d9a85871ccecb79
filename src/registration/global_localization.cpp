#include <algorithm>
#include <chrono>
#include <cmath>

#include "descent.h"
#include "result.h"
#include "start_poses.h"
#include "ttsdf_localization/registration/search.h"

namespace ttsdf {

const OptionTable<GlobalOptions>& globalOptionTable() {
  using O = GlobalOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("starts", &O::starts, 1, 10000000, "", "Starts over the free space with gravity known")
          .add("starts_without_gravity", &O::starts_without_gravity, 1, 10000000, "",
               "Starts without that hint")
          .add("coarse_points", &O::coarse_points, 6, 100000, "", "Points of the cheap descents")
          .add("refined", &O::refined, 1, 10000, "", "Best starts that are refined on all points")
          .add("tilt_sigma", &O::tilt_sigma, 0.0, 3.2, "rad", "Trust in the gravity hint")
          .add("min_margin", &O::min_margin, 0.0, 1.0, "",
               "The best other place must score worse by this much")
          .add("max_score", &O::max_score, 0.0, 1.0, "",
               "A worse best score is refused; seeing through walls counts")
          .add("threads", &O::threads, 1, 64, "", "Threads")
          .add("seed", &O::seed, 0, 2147483647, "", "Seed of the starts");
  return table;
}

namespace {

using Clock = std::chrono::steady_clock;
double secondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

std::vector<Eigen::Isometry3d> poses(const std::vector<Candidate>& candidates) {
  std::vector<Eigen::Isometry3d> result;
  for (const Candidate& c : candidates) result.push_back(c.T_map_sensor);
  return result;
}

/// Poses nearer than this are the same place.
constexpr double kSamePlace = 0.3;  // [m]
constexpr double kSameAngle = 0.3;  // [rad]

void judge(const GlobalOptions& options, RegistrationResult& best) {
  if (best.reason == TerminationReason::kTooFewPoints) return;
  if (verdict(best) > options.max_score || !best.success) {
    best.success = false;
    best.reason = TerminationReason::kLowScore;
  } else if (best.runner_up_score - verdict(best) < options.min_margin) {
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
  ScanBuffer scan;
  scan.setSensor(sensorModel(registration.options().sensor),
                 0.5 * registration.field().geometry().voxel_size);
  scan.assign(points, options.coarse_points);
  if (scan.size() < registration.options().min_points) {
    best.points = scan.size();
    return best;
  }
  std::optional<GravityHint> hint;
  if (gravity) hint = GravityHint{gravity->normalized(), map_down.normalized(), options.tilt_sigma};
  const DistanceField& coarse =
      registration.longRangeField() ? *registration.longRangeField() : registration.field();
  const auto starts = startsOverMap(registration.field(), coarse, hint, 0.1,
                                    gravity ? options.starts : options.starts_without_gravity, options.seed);

  bool cancelled = false;
  const auto keepGoing = [&](double share) {
    if (!cancelled && progress && !progress(share)) cancelled = true;
    return !cancelled;
  };
  DescentOptions wide;
  wide.scales = {0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.3, 0.3, 0.15, 0.15};
  wide.score_scale = 0.08;
  wide.threads = options.threads;
  const auto coarse_results = descendAll(coarse, scan, starts, wide, [&](std::size_t done) {
    return keepGoing(0.8 * static_cast<double>(done) / static_cast<double>(starts.size()));
  });
  DescentOptions narrow;
  narrow.scales = {0.15, 0.1, 0.1, 0.08};
  narrow.threads = options.threads;
  const auto wanted = static_cast<std::size_t>(options.refined);
  const auto middle = bestDistinct(coarse_results, 10 * wanted, 0.1, 0.1);
  const auto candidates = bestDistinct(descendAll(registration.field(), scan, poses(middle), narrow,
                                                  [&](std::size_t) { return keepGoing(0.8); }),
                                       wanted, 0.05, 0.05);

  best.points = scan.size();
  best.reason = TerminationReason::kLowScore;  // if no start came through in time
  if (!candidates.empty()) {
    std::vector<Eigen::Isometry3d> found;
    for (const Candidate& c : candidates) {
      found.push_back(inMapFrame(registration.field().geometry(), c.T_map_sensor));
    }
    best = registration.alignFrom(points, found, PosePrior{found.front(), Matrix6d::Zero()});
  }
  judge(options, best);
  if (cancelled) {
    best.success = false;
    best.reason = TerminationReason::kCancelled;
  }
  best.milliseconds = 1e3 * secondsSince(begin);
  return best;
}

}  // namespace ttsdf
