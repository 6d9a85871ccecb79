#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "ttsdf_localization/agreement/frame_comparison.h"

namespace ttsdf {

namespace {

// Logarithms of shift, turn about the sensor, turn about the scene, widening.
using Sizes = std::array<double, 4>;

FrameAgreement withSizes(const Sizes& logs) {
  FrameAgreement agreement;
  agreement.compared = 1;
  agreement.shift = std::exp(logs[0]);
  agreement.turn_sensor = std::exp(logs[1]);
  agreement.turn_scene = std::exp(logs[2]);
  agreement.widening = std::max(1.0, std::exp(logs[3]));
  return agreement;
}

/// Covariance that a difference should have, about the sensor's position.
Matrix6d expected(const FrameAgreement& agreement, const FrameDifference& difference,
                  double variance_ratio = 1.0) {
  return withMapErrors(agreement, difference.covariance, difference.covariance, difference.centroid,
                       variance_ratio);
}

/// Minus the logarithm of how likely the differences are, but for a constant: Student's distribution, whose
/// long tails leave a few frames without say.
double unlikelihood(const Sizes& logs, const std::vector<FrameDifference>& compared) {
  constexpr double kFreedom = 6.0;
  const FrameAgreement agreement = withSizes(logs);
  double sum = 0.0;
  for (const FrameDifference& d : compared) {
    const Eigen::LDLT<Matrix6d> solver(expected(agreement, d));
    const double square = d.step.dot(solver.solve(d.step));
    sum += solver.vectorD().array().max(1e-30).log().sum() +
           (kFreedom + 6.0) * std::log1p(std::max(square, 0.0) / kFreedom);
  }
  // Where frames say nothing about a size, it is a small one.
  constexpr double kPull = 0.05;
  for (const double log : logs) sum += kPull * log;
  return sum;
}

/// Best of a grid that narrows: four parameters, no derivatives, the same answer everywhere.
Sizes mostLikely(const std::vector<FrameDifference>& compared) {
  Sizes best = {{std::log(0.005), std::log(0.003), std::log(0.002), std::log(1.2)}};
  const Sizes least = {{std::log(1e-4), std::log(5e-5), std::log(5e-5), 0.0}};
  const Sizes most = {{std::log(0.5), std::log(0.5), std::log(0.5), std::log(10.0)}};
  double lowest = unlikelihood(best, compared);
  for (double step = 1.0; step > 0.03;) {
    bool better = false;
    for (std::size_t k = 0; k < best.size(); ++k) {
      for (const double sign : {-1.0, 1.0}) {
        Sizes trial = best;
        trial[k] = std::clamp(trial[k] + sign * step, least[k], most[k]);
        const double value = unlikelihood(trial, compared);
        if (value < lowest - 1e-9) best = trial, lowest = value, better = true;
      }
    }
    if (!better) step *= 0.5;
  }
  return best;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const double at = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (at - static_cast<double>(below)) * (values[above] - values[below]);
}

constexpr double kViewpointVoxels = 10.0;
constexpr double kMostRatio = 10.0;  // of one frame: a stray one does not blow up its neighbours

double squaredMahalanobis(const FrameDifference& d, const FrameAgreement& agreement, double variance_ratio) {
  return d.step.dot(expected(agreement, d, variance_ratio).ldlt().solve(d.step));
}

/// Every frame as a viewpoint of its own.
std::vector<ViewpointAgreement> ratiosOf(const std::vector<FrameDifference>& compared,
                                         const FrameAgreement& agreement) {
  std::vector<ViewpointAgreement> ratios;
  for (const FrameDifference& d : compared) {
    const double mean_square = squaredMahalanobis(d, agreement, 1.0) / 6.0;
    ratios.push_back({d.viewpoint, 1, std::clamp(mean_square, 1.0 / kMostRatio, kMostRatio)});
  }
  return ratios;
}

/// Frames join the first viewpoint that they lie near to.
std::vector<ViewpointAgreement> merged(const std::vector<ViewpointAgreement>& frames, double distance) {
  std::vector<ViewpointAgreement> groups;
  for (const ViewpointAgreement& frame : frames) {
    const auto near = [&](const ViewpointAgreement& group) {
      return std::hypot((group.viewpoint.position - frame.viewpoint.position).norm() / distance,
                        (group.viewpoint.view - frame.viewpoint.view).norm() / kViewpointAngle) < 1.0;
    };
    const auto group = std::find_if(groups.begin(), groups.end(), near);
    if (group == groups.end()) {
      groups.push_back(frame);
      continue;
    }
    const double share = 1.0 / ++group->frames;
    group->viewpoint.position += share * (frame.viewpoint.position - group->viewpoint.position);
    group->viewpoint.view += share * (frame.viewpoint.view - group->viewpoint.view);
    group->ratio += share * (frame.ratio - group->ratio);
  }
  return groups;
}

/// What the other frames make of each one's variances.
std::vector<double> ratiosFromOthers(const std::vector<ViewpointAgreement>& frames, double distance) {
  std::vector<double> ratios;
  FrameAgreement others;
  others.viewpoint_distance = distance;
  for (std::size_t n = 0; n < frames.size(); ++n) {
    others.viewpoints = frames;
    others.viewpoints.erase(others.viewpoints.begin() + static_cast<std::ptrdiff_t>(n));
    ratios.push_back(varianceRatio(others, frames[n].viewpoint));
  }
  return ratios;
}

/// Whether more of the differences lie far out than of six normal variables.
bool tooNarrow(const FrameAgreement& agreement, const std::vector<FrameDifference>& compared,
               const std::vector<double>& variance_ratios) {
  constexpr double kHalf = 5.35, kNineTenths = 10.64, kNineteenTwentieths = 12.59;  // chi-squared
  std::vector<double> squares;
  for (std::size_t n = 0; n < compared.size(); ++n)
    squares.push_back(squaredMahalanobis(compared[n], agreement, variance_ratios[n]));
  return quantile(squares, 0.5) > kHalf || quantile(squares, 0.9) > kNineTenths ||
         quantile(squares, 0.95) > kNineteenTwentieths;
}

}  // namespace

FrameAgreement summarize(const std::vector<FrameDifference>& differences, double voxel_size) {
  std::vector<FrameDifference> compared;
  std::vector<double> moved, turned;
  FrameAgreement agreement;
  for (const FrameDifference& d : differences) {
    agreement.without_overlap += d.outcome == FrameDifference::Outcome::kNoOverlap ? 1 : 0;
    agreement.contradicting += d.outcome == FrameDifference::Outcome::kContradicts ? 1 : 0;
    if (d.outcome != FrameDifference::Outcome::kCompared) continue;
    compared.push_back(d);
    moved.push_back(d.translation()), turned.push_back(d.rotation());
  }
  agreement.compared = static_cast<int>(compared.size());
  if (compared.empty()) return agreement;
  agreement.position_median = quantile(moved, 0.5), agreement.position_90 = quantile(moved, 0.9);
  agreement.rotation_median = quantile(turned, 0.5), agreement.rotation_90 = quantile(turned, 0.9);
  Sizes logs = mostLikely(compared);
  const double distance = kViewpointVoxels * voxel_size;
  const std::vector<ViewpointAgreement> ratios = ratiosOf(compared, withSizes(logs));
  const std::vector<double> variance_ratios = ratiosFromOthers(ratios, distance);
  constexpr double kWider = 0.05;
  for (int n = 0; n < 40 && tooNarrow(withSizes(logs), compared, variance_ratios); ++n) {
    for (double& log : logs) log += kWider;
  }
  const FrameAgreement sizes = withSizes(logs);
  agreement.shift = sizes.shift, agreement.turn_sensor = sizes.turn_sensor,
  agreement.turn_scene = sizes.turn_scene;
  agreement.widening = sizes.widening;
  agreement.viewpoint_distance = distance;
  agreement.viewpoints = merged(ratios, distance);
  return agreement;
}

}  // namespace ttsdf
