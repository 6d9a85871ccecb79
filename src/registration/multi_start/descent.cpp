#include "descent.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <future>
#include <system_error>

#include "../result.h"

namespace ttsdf {

namespace {

// Shares of the information that unit gradients would carry, as a pull back to the start.
constexpr double kTie = 1e-3;  // keeps directions in place that the scan says nothing about
constexpr double kRotationTie = 0.3;

/// Gauss-Newton step about the scan's centroid with the start as a weak prior.
Vector6d tiedStep(const NormalEquations& e, const ScanBuffer& scan, const Eigen::Isometry3d& T_start,
                  const Eigen::Isometry3d& T, double rotation_tie) {
  const double weight = e.weight + 1e-6, radius = std::max(scan.radius(), 1e-3);
  const double turning = rotation_tie * weight * radius * radius, moving = kTie * weight;
  Matrix6d H = e.H;
  H.diagonal().head<3>().array() += turning;
  H.diagonal().tail<3>().array() += moving;
  Vector6d g = e.g;
  g.head<3>() += turning * logSo3(T.linear() * T_start.linear().transpose());
  g.tail<3>() += moving * (T * scan.centroid() - T_start * scan.centroid());
  return H.ldlt().solve(-g);
}

}  // namespace

std::vector<double> geometricScales(double first, double last, int steps) {
  std::vector<double> scales;
  for (int n = 0; n < steps; ++n)
    scales.push_back(first * std::pow(last / first, n / std::max(1.0, steps - 1.0)));
  return scales;
}

Candidate descend(const DistanceField& field, const ScanBuffer& scan, const Eigen::Isometry3d& T_start,
                  const DescentOptions& options) {
  Candidate candidate{T_start, 1.0};
  ResidualModel model;
  model.score_scale = options.score_scale;
  const int points = scan.prefix(options.points);
  for (const double scale : options.scales) {
    model.scale = scale;
    const NormalEquations e = linearize(field, scan, points, candidate.T_map_sensor, model);
    if (e.valid < 6) return candidate;
    const Vector6d xi = tiedStep(e, scan, T_start, candidate.T_map_sensor,
                                 scale > options.rotation_tied_above ? kRotationTie : kTie);
    if (!xi.allFinite()) return candidate;
    candidate.T_map_sensor = retract(candidate.T_map_sensor, scan.centroid(), xi);
  }
  candidate.score = score(linearize(field, scan, points, candidate.T_map_sensor, model));
  return candidate;
}

std::vector<Candidate> descendAll(const DistanceField& field, const ScanBuffer& scan,
                                  const std::vector<Eigen::Isometry3d>& starts, const DescentOptions& options,
                                  const std::function<bool(std::size_t)>& keep_going) {
  constexpr std::size_t kBatch = 16;  // starts a thread takes at a time
  std::vector<Candidate> results(starts.size());
  std::atomic<std::size_t> next{0};
  std::atomic<bool> stop{false};
  const auto work = [&](bool asks) {
    while (!stop) {
      const std::size_t begin = next.fetch_add(kBatch);
      if (begin >= starts.size()) return;
      for (std::size_t n = begin; n < std::min(starts.size(), begin + kBatch); ++n) {
        results[n] = descend(field, scan, starts[n], options);
      }
      if (asks && keep_going && !keep_going(begin)) stop = true;
    }
  };
  // A future waits for its thread when it goes away, so that an exception of the callback passes through
  // here.
  std::vector<std::future<void>> helpers;
  try {
    for (int t = 1; t < options.threads; ++t) helpers.push_back(std::async(std::launch::async, work, false));
  } catch (const std::system_error&) {
    // The system gives no more threads: those there are do the work.
  }
  try {
    work(true);
  } catch (...) {
    stop = true;
    throw;
  }
  for (auto& helper : helpers) helper.get();
  return results;
}

std::vector<Candidate> bestDistinct(std::vector<Candidate> candidates, std::size_t count, double distance,
                                    double angle) {
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score < b.score; });
  std::vector<Candidate> kept;
  for (const Candidate& candidate : candidates) {
    if (kept.size() >= count || candidate.score >= 1.0) break;  // 1: never reached, or explains nothing
    const bool seen = std::any_of(kept.begin(), kept.end(), [&](const Candidate& k) {
      // Thousands are compared: angles only of those that are near.
      const Eigen::Isometry3d &T = k.T_map_sensor, &T_other = candidate.T_map_sensor;
      if ((T.translation() - T_other.translation()).squaredNorm() >= distance * distance) return false;
      return poseError(T, T_other).rotation < angle;
    });
    if (!seen) kept.push_back(candidate);
  }
  return kept;
}

}  // namespace ttsdf
