#include "verification.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>

#include "ttsdf_localization/geometry/pose_perturbation.h"

namespace ttsdf {

namespace {

constexpr double kProbedBelow = 0.15;   // share of the information; more needs no proof
constexpr double kPinnedBelow = 0.015;  // the same where the prior excludes the probes anyway
constexpr int kMostProbed = 3;          // directions, from the weakest
constexpr double kNoticed = 0.7;        // standard errors
constexpr double kBetter = -1.0;        // the same, of a pose that is worth a descent
constexpr double kCertain = 100.0;      // standard errors
constexpr double kPinned = 9.0;         // squared Mahalanobis distance that the prior excludes
constexpr double kFurther = 3.0;        // tolerances of the far probes
constexpr double kClear = 4.5;          // standard errors of a near probe that need no far one

/// Twist about the centroid along a direction of the scaled space that moves the pose by `distance`.
Vector6d twistAlong(const Vector6d& direction, const ScanBuffer& scan, const Eigen::Isometry3d& T,
                    double distance, double least_radius) {
  Vector6d xi = direction;
  xi.head<3>() /= std::max(scan.radius(), least_radius);
  const Matrix6d to_sensor = leverArmJacobian(T.linear() * scan.centroid());
  const double moved =
      std::max({(to_sensor * xi).tail<3>().norm(), xi.tail<3>().norm(), scan.radius() * xi.head<3>().norm()});
  return xi * (distance / std::max(moved, 1e-9));
}

}  // namespace

HeldOut::HeldOut(const ScanBuffer& scan, double cluster_size) {
  const int first = scan.fitted(), count = scan.size() - first;
  points_.resize(3, count);
  cluster_.resize(static_cast<std::size_t>(count));
  std::map<std::array<int, 3>, int> cells;
  const Eigen::Vector3f c = scan.centroid().cast<float>();
  for (int n = 0; n < count; ++n) {
    const Eigen::Vector3f p(scan.x()[first + n], scan.y()[first + n], scan.z()[first + n]);
    points_.col(n) = c + p;
    const Eigen::Array3i cell = (p.array() / static_cast<float>(cluster_size)).floor().cast<int>();
    const auto found = cells.emplace(std::array<int, 3>{{cell[0], cell[1], cell[2]}}, clusters_);
    if (found.second) ++clusters_;
    cluster_[static_cast<std::size_t>(n)] = found.first->second;
  }
}

HeldOut::Losses HeldOut::losses(const DistanceField& field, const Eigen::Isometry3d& T,
                                const ResidualModel& model, double tolerance) const {
  Losses out;
  const Eigen::Matrix3Xf rotated = T.linear().cast<float>() * points_;
  const Eigen::Matrix3Xf points = rotated.colwise() + T.translation().cast<float>();
  const FieldSamples samples = field.evaluate(points);
  out.loss.assign(static_cast<std::size_t>(size()), -1.0f);
  const auto s2 = static_cast<float>(model.scale * model.scale);
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    if (samples.states[static_cast<std::size_t>(n)] != PointState::kValid) continue;
    const float r = samples.values[n];
    if (model.check_facing) {
      const double cosine = static_cast<double>(rotated.col(n).dot(samples.gradients.col(n)) /
                                                std::max(rotated.col(n).norm(), 1e-6f));
      if (seenFromBehind(static_cast<double>(r), cosine, model)) continue;
    }
    out.loss[static_cast<std::size_t>(n)] = r * r / (r * r + s2);
    ++out.known;
    out.explained += std::abs(static_cast<double>(r)) < tolerance ? 1 : 0;
  }
  return out;
}

double HeldOut::evidence(const Losses& here, const Losses& there) const {
  std::vector<double> sums(static_cast<std::size_t>(clusters_), 0.0);
  std::vector<char> used(static_cast<std::size_t>(clusters_), 0);
  for (std::size_t n = 0; n < cluster_.size(); ++n) {
    if (here.loss[n] < 0.0f || there.loss[n] < 0.0f) continue;
    const auto c = static_cast<std::size_t>(cluster_[n]);
    sums[c] += static_cast<double>(there.loss[n]) - static_cast<double>(here.loss[n]);
    used[c] = 1;
  }
  double count = 0.0, sum = 0.0, squares = 0.0;
  for (std::size_t c = 0; c < sums.size(); ++c) {
    if (used[c]) count += 1.0, sum += sums[c], squares += sums[c] * sums[c];
  }
  if (count < 4.0) return 0.0;
  const double mean = sum / count;
  const double variance = std::max(0.0, squares / count - mean * mean) * count / (count - 1.0);
  // Differences below a thousandth of a point's loss are the map's noise.
  return mean / std::sqrt(variance / count + 1e-6);
}

namespace {

/// Where the scan has the least evidence against being elsewhere.
struct Probe {
  double evidence = kCertain;  // standard errors
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
};

/// Of the poses near and far to both sides along a twist.
Probe weakestProbe(const DistanceField& field, const ScanBuffer& scan, const HeldOut& held_out,
                   const HeldOut::Losses& here, const Eigen::Isometry3d& T, const Vector6d& xi,
                   const ResidualModel& model, double tolerance) {
  Probe weakest;
  for (const double side : {-1.0, 1.0}) {
    for (const double far : {1.0, kFurther}) {
      const Eigen::Isometry3d T_there = retract(T, scan.centroid(), side * far * xi);
      const double evidence = held_out.evidence(here, held_out.losses(field, T_there, model, tolerance));
      if (evidence < weakest.evidence) weakest = {evidence, T_there};
      if (evidence > kClear) break;
    }
  }
  return weakest;
}

}  // namespace

Verification verify(const DistanceField& field, const ScanBuffer& scan, const HeldOut& held_out,
                    const Eigen::Isometry3d& T, const NormalEquations& equations, const PosePrior& prior,
                    const ResidualModel& model, const Scales& scales, double degenerate_threshold) {
  Verification out;
  const HeldOut::Losses here = held_out.losses(field, T, model, scales.tolerance);
  out.explained_ratio = static_cast<double>(here.explained) / std::max(1, here.known);
  const InformationAnalysis info = analyseInformation(equations, scan.radius());
  Matrix6d prior_information = Matrix6d::Zero();
  Vector6d unused = Vector6d::Zero();
  prior.add(T, scan.centroid(), prior_information, unused);
  double lowest = kBetter;
  for (int d = 0; d < 6; ++d) {
    const bool no_information = !(info.share[d] >= degenerate_threshold);
    if (!no_information && (d >= kMostProbed || info.share[d] > kProbedBelow)) continue;
    const Vector6d xi = twistAlong(info.directions.col(d), scan, T, scales.probe, 1e-3);
    const bool pinned = xi.dot(prior_information * xi) > kPinned;
    // A prior that excludes the probes does not make the scan a measurement: along a wall the pose would
    // follow the prior from scan to scan, and each one would count as fixed.
    if (pinned && !no_information && info.share[d] > kPinnedBelow) continue;
    Probe probe;
    if (!no_information) probe = weakestProbe(field, scan, held_out, here, T, xi, model, scales.tolerance);
    const auto index = static_cast<std::size_t>(d);
    out.without_information[index] = no_information;
    out.without_evidence[index] = !no_information && probe.evidence < kNoticed;
    const bool degenerate = no_information || out.without_evidence[index];
    if (degenerate) ++out.degenerate_directions;
    if (pinned) continue;  // the prior vouches for it
    if (degenerate) {
      ++out.open_directions;
    } else {
      out.least_evidence = std::min(out.least_evidence, probe.evidence);
    }
    out.weakest = std::min(out.weakest, no_information ? 0.0 : probe.evidence);
    if (probe.evidence < lowest) {
      lowest = probe.evidence;
      out.better_poses.assign(1, probe.T_map_sensor);
    }
  }
  return out;
}

double confidence(const ConfidenceFeatures& f) {
  // Fitted with a forerunner of scripts/results fit_confidence, on seven scenes.
  const double sum = -3.44 + 5.30 * std::max(-1.0, std::min(f.least_evidence, 1.5)) -
                     16.27 * std::max(0.0, 0.92 - f.explained_ratio) -
                     16.65 * std::min(f.blocked_ratio, 0.2) - 0.52 * std::max(0.0, f.unmapped_ratio - 0.3);
  return 1.0 / (1.0 + std::exp(-sum));
}

}  // namespace ttsdf
