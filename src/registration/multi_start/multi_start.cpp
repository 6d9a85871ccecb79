#include "multi_start.h"

#include <algorithm>
#include <cmath>

#include "start_poses.h"

namespace ttsdf {

namespace {

constexpr double kSameTurn = 0.1;  // [rad] between candidates of one place
constexpr int kFirstPoints = 150;  // of descents that only tell good starts from bad ones
// Candidates per place wanted. The far field is coarse: where its grid is wide the right place may be some
// hundredth among them, and a wrong one that was looked at in the map would be taken.
constexpr std::size_t kNarrowed = 250;  // go on in the far field, with a narrower kernel
constexpr std::size_t kLookedAt = 40;   // of these descend in the map
constexpr std::size_t kRetried = 3;     // of these are retried from around them

std::vector<Eigen::Isometry3d> posesOf(const std::vector<Candidate>& candidates) {
  std::vector<Eigen::Isometry3d> result;
  for (const Candidate& c : candidates) result.push_back(c.T_map_sensor);
  return result;
}

std::vector<Eigen::Isometry3d> betterPart(std::vector<Candidate> candidates, double part) {
  const auto count = static_cast<std::size_t>(std::ceil(part * static_cast<double>(candidates.size())));
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score < b.score; });
  candidates.resize(std::min(candidates.size(), count));
  return posesOf(candidates);
}

ScanBuffer bufferOf(const Registration& registration, const ScanPoints& points, int count) {
  ScanBuffer scan;
  scan.setSensor(sensorModel(registration.options().sensor),
                 0.5 * registration.field().geometry().voxel_size);
  scan.assign(points, count);
  return scan;
}

}  // namespace

MultiStart::MultiStart(const Registration& registration, const ScanPoints& points, int coarse_points)
    : near_(registration.nearFarField()),
      coarse_(registration.longRangeField() ? *registration.longRangeField() : registration.field()),
      scan_(bufferOf(registration, points, coarse_points)),
      scales_(registration.options(), near_.geometry().voxel_size, coarse_.geometry().voxel_size, scan_) {}

std::vector<Eigen::Isometry3d> MultiStart::places(const std::vector<Eigen::Isometry3d>& starts,
                                                  const Options& options, const KeepGoing& keep_going) const {
  const double last = scales_.far_last, first = std::max(last, options.first * scan_.radius()),
               between = std::sqrt(first * last), tolerance = scales_.tolerance;
  DescentOptions descent;
  descent.rotation_tied_above = scales_.tied_above;
  descent.threads = options.threads;
  double begun = 0.0;  // of the work
  const auto descendIn = [&](const DistanceField& field, const std::vector<Eigen::Isometry3d>& from,
                             std::vector<double> kernels, double score_scale, double until) {
    descent.scales = std::move(kernels);
    descent.score_scale = score_scale;
    auto found = descendAll(field, scan_, from, descent, [&](std::size_t done) {
      const double share = static_cast<double>(done) / static_cast<double>(from.size());
      return !keep_going || keep_going(begun + (until - begun) * share);
    });
    begun = until;
    return found;
  };
  const auto better = [&](const std::vector<Candidate>& all, std::size_t per_place) {
    return posesOf(bestDistinct(all, per_place * options.refined, 2.0 * tolerance, kSameTurn));
  };
  descent.points = kFirstPoints;
  const auto seen = descendIn(coarse_, starts, {first, first, first}, last, 0.3);
  descent.points = scan_.size();
  const auto far = descendIn(coarse_, betterPart(seen, options.kept_part),
                             {first, first, first, between, between, last, last}, 0.5 * last, 0.7);
  const double narrow = 0.5 * last;
  const auto narrowed = descendIn(coarse_, better(far, kNarrowed),
                                  {last, narrow, narrow, narrow, narrow, narrow}, 0.25 * last, 0.8);
  const double near_first = 2.0 * tolerance, near_last = 1.6 * tolerance;
  const std::vector<double> near_kernels{last, last, near_first, near_first, near_first, near_last};
  auto near = descendIn(near_, better(narrowed, kLookedAt), near_kernels, tolerance, 0.85);
  const auto retried = descendIn(
      near_,
      around(bestDistinct(near, kRetried * options.refined, tolerance, 0.5 * kSameTurn), options.retries),
      near_kernels, tolerance, 0.9);
  near.insert(near.end(), retried.begin(), retried.end());
  std::vector<Eigen::Isometry3d> found;
  for (const Candidate& c : bestDistinct(near, options.refined, tolerance, 0.5 * kSameTurn))
    found.push_back(inMapFrame(near_.geometry(), c.T_map_sensor));
  return found;
}

std::vector<Eigen::Isometry3d> MultiStart::around(const std::vector<Candidate>& places, int count) const {
  Matrix6d spread = Matrix6d::Zero();
  spread.diagonal().head<3>().setConstant(std::pow(scales_.near_first / scales_.lever, 2));
  spread.diagonal().tail<3>().setConstant(std::pow(scales_.near_first, 2));
  std::vector<Eigen::Isometry3d> starts;
  for (const Candidate& place : places) {
    const auto more = startsAround(place.T_map_sensor, spread, count + 1, 0);
    starts.insert(starts.end(), more.begin() + 1, more.end());  // the first is the place itself
  }
  return starts;
}

}  // namespace ttsdf
