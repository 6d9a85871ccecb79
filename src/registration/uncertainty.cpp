#include "uncertainty.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "minimizer.h"

namespace ttsdf {

namespace {

// Errors are correlated within a cluster, so more points than this say nothing more about the spread of
// clusters.
constexpr int kPoints = 1200;

constexpr double kNoInformation = 1e-6;

/// Share of the information that a direction along flat walls shows by the noise of the map's gradients
/// alone: 0.003 where residuals are 1 cm, less where they say that the map is better.
double gradientNoise(const NormalEquations& equations) {
  constexpr double kLeast = 0.001, kMore = 0.002, kRms = 0.01;  // [m]
  const double squares = equations.inlier_squares / std::max(1, equations.inliers);
  return kLeast + kMore * std::min(1.0, squares / (kRms * kRms));
}

/// Score vectors w r J of the valid points with the key of the cell they fall into, sorted by cell.
struct ClusteredScore {
  std::uint64_t cell;
  Vector6d score;
};

std::uint64_t cellKey(float x, float y, float z, double size) {
  const auto quantise = [size](float v) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(v / size)) + (1 << 20)) & 0x1fffff;
  };
  return quantise(x) | (quantise(y) << 21) | (quantise(z) << 42);
}

std::vector<ClusteredScore> scores(const DistanceField& field, const ScanBuffer& scan, int count,
                                   const Eigen::Isometry3d& T_map_sensor, const ResidualModel& model,
                                   double cluster) {
  Eigen::Matrix3Xf lever(3, count);
  for (int n = 0; n < count; ++n) lever.col(n) << scan.x()[n], scan.y()[n], scan.z()[n];
  lever = T_map_sensor.linear().cast<float>() * lever;
  const Eigen::Matrix3Xf points = lever.colwise() + (T_map_sensor * scan.centroid()).cast<float>().eval();
  const FieldSamples samples = field.evaluate(points);
  std::vector<ClusteredScore> result;
  result.reserve(static_cast<std::size_t>(count));
  for (int n = 0; n < count; ++n) {
    if (samples.states[static_cast<std::size_t>(n)] != PointState::kValid) continue;
    const double r = static_cast<double>(samples.values[n]);
    const double q = model.scale * model.scale / (r * r + model.scale * model.scale);
    const double weight = static_cast<double>(scan.weight()[n]) * (model.robust ? q * q : 1.0);
    Eigen::Vector3d gradient = samples.gradients.col(n).cast<double>();
    const Eigen::Vector3d ray = points.col(n).cast<double>() - T_map_sensor.translation();
    if (model.check_facing && seenFromBehind(r, gradient.dot(ray) / std::max(ray.norm(), 1e-6))) continue;
    if (gradient.norm() > 1.0) gradient.normalize();
    Vector6d J;
    J << lever.col(n).cast<double>().cross(gradient), gradient;
    result.push_back({cellKey(points(0, n), points(1, n), points(2, n), cluster), weight * r * J});
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const ClusteredScore& a, const ClusteredScore& b) { return a.cell < b.cell; });
  return result;
}

}  // namespace

Matrix6d sandwichCovariance(const DistanceField& field, const ScanBuffer& scan,
                            const Eigen::Isometry3d& T_map_sensor, const ResidualModel& model,
                            double cluster_size, double weak_threshold, double weak_sigma) {
  const int count = scan.prefix(kPoints);
  const NormalEquations equations = linearize(field, scan, count, T_map_sensor, model);
  const InformationAnalysis info = analyseInformation(equations, scan.radius());
  Vector6d s = Vector6d::Ones();
  s.head<3>().setConstant(1.0 / std::max(scan.radius(), 1e-3));

  Matrix6d B = Matrix6d::Zero();
  int clusters = 0;
  const auto sorted = scores(field, scan, count, T_map_sensor, model, cluster_size);
  for (std::size_t begin = 0; begin < sorted.size();) {
    std::size_t end = begin;
    Vector6d sum = Vector6d::Zero();
    for (; end < sorted.size() && sorted[end].cell == sorted[begin].cell; ++end) sum += sorted[end].score;
    sum = info.directions.transpose() * (s.asDiagonal() * sum);
    B += sum * sum.transpose();
    ++clusters;
    begin = end;
  }
  // Small-sample correction: six parameters were fitted to as many independent scores as there are clusters.
  B *= static_cast<double>(clusters) / std::max(1, clusters - 6);
  const double noise = gradientNoise(equations), known_from = std::max(weak_threshold, kNoInformation);
  Vector6d inverse = Vector6d::Zero();
  for (int d = 0; d < 6; ++d) {
    // What the noise of the map's gradients shows says nothing.
    const double share = std::max(info.share[d] - noise, 0.1 * info.share[d]);
    if (info.share[d] >= known_from) inverse[d] = 1.0 / (share * equations.weight);
  }
  Matrix6d scaled = inverse.asDiagonal() * B * inverse.asDiagonal();
  for (int d = 0; d < 6; ++d) {
    if (info.share[d] < known_from) scaled(d, d) = weak_sigma * weak_sigma;
  }
  const Matrix6d back = s.asDiagonal() * info.directions;
  return back * scaled * back.transpose();
}

}  // namespace ttsdf
