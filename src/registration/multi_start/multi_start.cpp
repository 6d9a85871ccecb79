#include "multi_start.h"

#include <algorithm>
#include <cmath>

#include "descent.h"

namespace ttsdf {

namespace {

constexpr double kSameTurn = 0.1;      // [rad] between candidates of one place
constexpr std::size_t kLookedAt = 10;  // candidates that descend in the map, per place wanted

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
    : field_(registration.field()),
      coarse_(registration.longRangeField() ? *registration.longRangeField() : registration.field()),
      scan_(bufferOf(registration, points, coarse_points)),
      scales_(registration.options(), field_.geometry().voxel_size, coarse_.geometry().voxel_size, scan_) {}

std::vector<Eigen::Isometry3d> MultiStart::places(const std::vector<Eigen::Isometry3d>& starts,
                                                  const Options& options, const KeepGoing& keep_going) const {
  const double last = scales_.far_last, first = std::max(last, options.first * scan_.radius()),
               between = std::sqrt(first * last), tolerance = scales_.tolerance;
  const auto descendIn = [&](const DistanceField& field, const std::vector<Eigen::Isometry3d>& from,
                             std::vector<double> kernels, double score_scale, double begins, double ends) {
    DescentOptions descent;
    descent.scales = std::move(kernels);
    descent.score_scale = score_scale;
    descent.rotation_tied_above = scales_.tied_above;
    descent.threads = options.threads;
    return descendAll(field, scan_, from, descent, [&](std::size_t done) {
      const double share = static_cast<double>(done) / static_cast<double>(from.size());
      return !keep_going || keep_going(begins + (ends - begins) * share);
    });
  };
  const auto begun = descendIn(coarse_, starts, {first, first, first}, last, 0.0, 0.4);
  const auto far = descendIn(coarse_, betterPart(begun, options.kept_part),
                             {first, first, first, between, between, last, last}, 0.5 * last, 0.4, 0.8);
  const auto middle = bestDistinct(far, kLookedAt * options.refined, 2.0 * tolerance, kSameTurn);
  const auto near = descendIn(field_, posesOf(middle),
                              {last, 2.0 * tolerance, 2.0 * tolerance, 1.6 * tolerance}, tolerance, 0.8, 0.9);
  std::vector<Eigen::Isometry3d> found;
  for (const Candidate& c : bestDistinct(near, options.refined, tolerance, 0.5 * kSameTurn))
    found.push_back(inMapFrame(field_.geometry(), c.T_map_sensor));
  return found;
}

}  // namespace ttsdf
