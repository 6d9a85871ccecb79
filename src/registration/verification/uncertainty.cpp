#include "uncertainty.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "../solver/minimizer.h"

namespace ttsdf {

namespace {

// Errors are correlated within a cluster, so more points than this say nothing more about the spread of
// clusters.
constexpr int kPoints = 1000;

constexpr double kNoInformation = 1e-6;

// Points of one orientation within a cell of this size, in radii of the scan, are taken to lie on the same
// surface. Cells meet at the scan's centroid: a wall may be off, and tilted.
constexpr double kSurfaceRadii = 1.5;
// Offset of a surface that leaves no trace at all in the residuals, in voxels: interpolation, steps of the
// sensor.
constexpr double kHiddenOffset = 0.025;

/// What a valid point says, and the cell and surface it belongs to.
struct Score {
  std::uint64_t cell, surface;
  double weight, residual;
  Vector6d jacobian;
};
using Scores = std::vector<Score>;

std::uint64_t cellKey(float x, float y, float z, double size) {
  const auto quantise = [size](float v) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(v / size)) + (1 << 20)) & 0x1fffff;
  };
  return quantise(x) | (quantise(y) << 21) | (quantise(z) << 42);
}

/// One per axis and sense of the normal, and cell of `size` [m] about `centre`.
std::uint64_t surfaceKey(const Eigen::Vector3f& point, const Eigen::Vector3d& normal,
                         const Eigen::Vector3f& centre, double size) {
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  const Eigen::Vector3f p = point - centre;
  const auto side = static_cast<std::uint64_t>(2 * axis + (normal[axis] > 0.0 ? 1 : 0));
  return 8 * cellKey(p.x(), p.y(), p.z(), size) + side;
}

Scores scoresOf(const DistanceField& field, const ScanBuffer& scan, int count,
                const Eigen::Isometry3d& T_map_sensor, const ResidualModel& model, double cluster) {
  Eigen::Matrix3Xf lever(3, count);
  for (int n = 0; n < count; ++n) lever.col(n) << scan.x()[n], scan.y()[n], scan.z()[n];
  lever = T_map_sensor.linear().cast<float>() * lever;
  const Eigen::Vector3f centre = (T_map_sensor * scan.centroid()).cast<float>();
  const Eigen::Matrix3Xf points = lever.colwise() + centre;
  const FieldSamples samples = field.evaluate(points);
  const double surface = kSurfaceRadii * std::max(scan.radius(), 1e-3);
  Scores result;
  result.reserve(static_cast<std::size_t>(count));
  for (int n = 0; n < count; ++n) {
    if (samples.states[static_cast<std::size_t>(n)] != PointState::kValid) continue;
    const double r = static_cast<double>(samples.values[n]);
    const double q = model.scale * model.scale / (r * r + model.scale * model.scale);
    const double weight = static_cast<double>(scan.weight()[n]) * (model.robust ? q * q : 1.0);
    Eigen::Vector3d gradient = samples.gradients.col(n).cast<double>();
    const Eigen::Vector3d ray = points.col(n).cast<double>() - T_map_sensor.translation();
    if (model.check_facing && seenFromBehind(r, gradient.dot(ray) / std::max(ray.norm(), 1e-6), model))
      continue;
    if (gradient.norm() > 1.0) gradient.normalize();
    Vector6d J;
    J << lever.col(n).cast<double>().cross(gradient), gradient;
    result.push_back({cellKey(points(0, n), points(1, n), points(2, n), cluster),
                      surfaceKey(points.col(n), gradient, centre, surface), weight, r, J});
  }
  return result;
}

/// Calls `visit` for the scores of every cell, or every surface; returns how many there are. In the order of
/// the scores, so that sums do not depend on the machine.
template <class Visit>
int forEachGroup(const Scores& scores, std::uint64_t Score::*key, const Visit& visit) {
  std::unordered_map<std::uint64_t, std::size_t> index;
  std::vector<std::vector<const Score*>> groups;
  for (const Score& score : scores) {
    const auto place = index.emplace(score.*key, groups.size());
    if (place.second) groups.emplace_back();
    groups[place.first->second].push_back(&score);
  }
  for (const auto& group : groups) visit(group);
  return static_cast<int>(groups.size());
}

/// Variance of what the residuals of a cell have in common [m^2]: the mean product of two of them. Noise that
/// is independent from point to point adds nothing to it.
class SharedVariance {
 public:
  void add(const std::vector<const Score*>& cell) {
    double w = 0.0, w2 = 0.0, wr = 0.0, w2r2 = 0.0;
    for (const Score* s : cell) {
      const double product = s->weight * s->residual;
      w += s->weight, w2 += s->weight * s->weight, wr += product, w2r2 += product * product;
    }
    if (!(w > 0.0)) return;
    products_ += (wr * wr - w2r2) / w;
    weights_ += (w * w - w2) / w;
  }
  double value() const { return weights_ > 0.0 ? std::max(0.0, products_ / weights_) : 0.0; }

 private:
  double products_ = 0.0, weights_ = 0.0;  // of pairs
};

}  // namespace

double gradientNoise(const NormalEquations& equations, double voxel) {
  constexpr double kLeast = 0.001, kMore = 0.002, kRmsVoxels = 0.5;
  const double rms = std::sqrt(equations.inlier_squares / std::max(1, equations.inliers));
  const double share = rms / (kRmsVoxels * voxel);
  return kLeast + kMore * std::min(1.0, share * share);
}

Matrix6d sandwichCovariance(const DistanceField& field, const ScanBuffer& scan,
                            const Eigen::Isometry3d& T_map_sensor, const NormalEquations& equations,
                            const ResidualModel& model, double cluster_size, double weak_threshold,
                            double weak_sigma) {
  const int count = scan.prefix(kPoints);
  const InformationAnalysis info = analyseInformation(equations, scan.radius());
  Vector6d s = Vector6d::Ones();
  s.head<3>().setConstant(1.0 / std::max(scan.radius(), 1e-3));

  const auto scaled_twist = [&](const Vector6d& sum) -> Vector6d {
    return info.directions.transpose() * (s.asDiagonal() * sum);
  };
  const Scores scores = scoresOf(field, scan, count, T_map_sensor, model, cluster_size);
  double weight = 0.0;
  for (const Score& score : scores) weight += score.weight;
  Matrix6d B = Matrix6d::Zero();
  SharedVariance shared;
  const int clusters = forEachGroup(scores, &Score::cell, [&](const auto& group) {
    Vector6d sum = Vector6d::Zero();
    for (const Score* n : group) sum += n->weight * n->residual * n->jacobian;
    const Vector6d twist = scaled_twist(sum);
    B += twist * twist.transpose();
    shared.add(group);
  });
  // Small-sample correction: six parameters were fitted to as many independent scores as there are clusters.
  B *= static_cast<double>(clusters) / std::max(1, clusters - 6);
  // The pose takes up the offset of a whole surface, and the residuals do not show it: it is taken to be as
  // large as what neighbours have in common.
  const double hidden = kHiddenOffset * field.geometry().voxel_size;
  const double offset_variance = shared.value() + hidden * hidden;
  forEachGroup(scores, &Score::surface, [&](const auto& group) {
    Vector6d sum = Vector6d::Zero();
    for (const Score* n : group) sum += n->weight * n->jacobian;
    const Vector6d twist = scaled_twist(sum);
    B += offset_variance * twist * twist.transpose();
  });
  const double noise = gradientNoise(equations, field.geometry().voxel_size),
               known_from = std::max(weak_threshold, kNoInformation);
  Vector6d inverse = Vector6d::Zero();
  for (int d = 0; d < 6; ++d) {
    // What the noise of the map's gradients shows says nothing.
    const double share = std::max(info.share[d] - noise, 0.1 * info.share[d]);
    if (info.share[d] >= known_from) inverse[d] = 1.0 / (share * weight);
  }
  Matrix6d scaled = inverse.asDiagonal() * B * inverse.asDiagonal();
  for (int d = 0; d < 6; ++d) {
    if (info.share[d] < known_from) scaled(d, d) = weak_sigma * weak_sigma;
  }
  const Matrix6d back = s.asDiagonal() * info.directions;
  return back * scaled * back.transpose();
}

}  // namespace ttsdf
