#include <algorithm>
#include <chrono>
#include <cmath>

#include "descent.h"
#include "result.h"
#include "scales.h"
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

constexpr double kSameAngle = 0.1;  // [rad] of candidates
constexpr double kKeptPart = 0.35;  // of the starts, after a few steps with the widest kernel

/// Kernel scales of the descents, and how far apart poses are others [m], from those of the registration.
struct GlobalScales {
  explicit GlobalScales(const Scales& s, double radius)
      : clearance(std::min(5.0 * s.voxel, 0.1 * radius)),
        tolerance(s.tolerance),
        last(s.far_last),
        tied_above(s.tied_above) {
    const double first = std::max(s.far_last, 0.5 * radius), second = std::sqrt(first * s.far_last);
    widest = {first, first, first};
    wide = {first, first, first, second, second, last, last};
    narrow = {last, 2.0 * s.tolerance, 2.0 * s.tolerance, 1.6 * s.tolerance};
  }
  double clearance;  ///< of a sensor from the nearest surface
  double tolerance, last, tied_above;
  std::vector<double> widest, wide, narrow;
};

/// The better part of the candidates: only they are worth more steps.
std::vector<Eigen::Isometry3d> betterPart(std::vector<Candidate> candidates) {
  const auto count = static_cast<std::size_t>(std::ceil(kKeptPart * static_cast<double>(candidates.size())));
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score < b.score; });
  candidates.resize(std::min(candidates.size(), count));
  return poses(candidates);
}

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
  const GlobalScales scales(Scales(registration.options(), registration.field().geometry().voxel_size,
                                   coarse.geometry().voxel_size, scan),
                            scan.radius());
  const auto starts = startsOverMap(registration.field(), coarse, hint, scales.clearance,
                                    gravity ? options.starts : options.starts_without_gravity, options.seed);

  bool cancelled = false;
  const auto keepGoing = [&](double share) {
    if (!cancelled && progress && !progress(share)) cancelled = true;
    return !cancelled;
  };
  const auto descendFrom = [&](const DistanceField& field, const std::vector<Eigen::Isometry3d>& from,
                               const std::vector<double>& kernels, double score_scale, double begins,
                               double ends) {
    DescentOptions descent;
    descent.scales = kernels;
    descent.score_scale = score_scale;
    descent.rotation_tied_above = scales.tied_above;
    descent.threads = options.threads;
    return descendAll(field, scan, from, descent, [&](std::size_t done) {
      return keepGoing(begins +
                       (ends - begins) * static_cast<double>(done) / static_cast<double>(from.size()));
    });
  };
  const auto begun = descendFrom(coarse, starts, scales.widest, scales.last, 0.0, 0.4);
  const auto far = descendFrom(coarse, betterPart(begun), scales.wide, 0.5 * scales.last, 0.4, 0.8);
  const auto wanted = static_cast<std::size_t>(options.refined);
  const auto middle = bestDistinct(far, 10 * wanted, 2.0 * scales.tolerance, kSameAngle);
  const auto near =
      descendFrom(registration.field(), poses(middle), scales.narrow, DescentOptions().score_scale, 0.8, 0.9);
  const auto candidates = bestDistinct(near, wanted, scales.tolerance, 0.5 * kSameAngle);

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
