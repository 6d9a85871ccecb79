#include "linearizer.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "residual_kernels.h"
#include "ttsdf_localization/geometry/median.h"

namespace ttsdf {

namespace {

constexpr float kNoLimit = 1e30f;

KernelPose toPose(const Eigen::Isometry3d& T, const Eigen::Vector3d& centroid) {
  KernelPose pose{};
  const Eigen::Vector3d t = T * centroid;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      pose.R[row][column] = static_cast<float>(T.linear()(row, column));
    pose.t[row] = static_cast<float>(t[row]);
  }
  return pose;
}

KernelConstants toConstants(const ResidualModel& model) {
  const auto squared = [](double v) { return static_cast<float>(v * v); };
  return {squared(model.scale),
          model.robust ? 1.0f : 0.0f,
          squared(model.inlier_distance),
          squared(model.score_scale),
          model.limit_gradient ? 1.0f : 0.0f,
          model.check_facing ? squared(kBehindCosine) : kNoLimit,
          model.check_facing ? static_cast<float>(-model.deep_inside) : -kNoLimit};
}

void addSums(const float (*sums)[kLanes], double* total) {
  for (int s = 0; s < kSums; ++s) {
    float lanes = 0.0f;
    for (int l = 0; l < kLanes; ++l) lanes += sums[s][l];
    total[s] += static_cast<double>(lanes);
  }
}

/// Calls `visit(chunk)` with the residuals of the first `count` points, chunk by chunk.
template <class Visit>
void forEachChunk(const DistanceField& field, const ScanBuffer& scan, int count,
                  const Eigen::Isometry3d& T_map_sensor, const ResidualModel& model, const Visit& visit) {
  const KernelPose pose = toPose(T_map_sensor, scan.centroid());
  const KernelConstants constants = toConstants(model);
  ResidualChunk chunk;
  const Eigen::Vector3d ray = T_map_sensor.linear() * scan.centroid();
  for (int axis = 0; axis < 3; ++axis) chunk.ray[axis] = static_cast<float>(ray[axis]);
  for (int begin = 0; begin < count; begin += kChunkPoints) {
    chunk.size = std::min(kChunkPoints, count - begin);
    transformChunk(scan.x() + begin, scan.y() + begin, scan.z() + begin, pose, chunk);
    chunk.point_weight = scan.weight() + begin;
    field.evaluate(PointSpan{chunk.x, chunk.y, chunk.z, chunk.size},
                   SampleSpan{chunk.value, chunk.gx, chunk.gy, chunk.gz, chunk.state});
    residualChunk(chunk, constants);
    visit(chunk);
  }
}

}  // namespace

NormalEquations linearize(const DistanceField& field, const ScanBuffer& scan, int count,
                          const Eigen::Isometry3d& T_map_sensor, const ResidualModel& model) {
  NormalEquations out;
  KernelCounts counts;
  double total[kSums] = {};
  forEachChunk(field, scan, count, T_map_sensor, model, [&](const ResidualChunk& chunk) {
    alignas(64) float sums[kSums][kLanes] = {};
    sumChunk(chunk, sums);
    addSums(sums, total);
    countChunk(chunk, counts);
  });
  int s = 0;
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b <= a; ++b, ++s) out.H(a, b) = out.H(b, a) = total[s];
    out.g[a] = total[21 + a];
  }
  out.cost = total[27], out.score = total[28], out.inlier_squares = total[29], out.weight = total[30];
  out.squares = total[31];
  out.valid = counts.valid, out.inliers = counts.inliers, out.outside = counts.outside;
  out.behind = counts.behind;
  out.unknown = count - out.valid - out.outside - out.behind;
  return out;
}

double residualSpread(const DistanceField& field, const ScanBuffer& scan, int count,
                      const Eigen::Isometry3d& T_map_sensor, const ResidualModel& model) {
  constexpr double kSigmaPerMedian = 1.4826;
  std::vector<float> sizes;
  sizes.reserve(static_cast<std::size_t>(count));
  forEachChunk(field, scan, count, T_map_sensor, model, [&](const ResidualChunk& chunk) {
    for (int n = 0; n < chunk.size; ++n) {
      if (chunk.valid[n] > 0.0f) sizes.push_back(std::abs(chunk.value[n]));
    }
  });
  if (sizes.empty()) return 0.0;
  return kSigmaPerMedian * static_cast<double>(upperMedian(sizes));
}

void prepare(const DistanceField& field, const ScanBuffer& scan, int count,
             const Eigen::Isometry3d& T_map_sensor) {
  const KernelPose pose = toPose(T_map_sensor, scan.centroid());
  std::vector<float> x, y, z;
  ResidualChunk chunk;
  for (int begin = 0; begin < count; begin += kChunkPoints) {
    chunk.size = std::min(kChunkPoints, count - begin);
    transformChunk(scan.x() + begin, scan.y() + begin, scan.z() + begin, pose, chunk);
    x.insert(x.end(), chunk.x, chunk.x + chunk.size);
    y.insert(y.end(), chunk.y, chunk.y + chunk.size);
    z.insert(z.end(), chunk.z, chunk.z + chunk.size);
  }
  field.prepare(PointSpan{x.data(), y.data(), z.data(), count});
}

Eigen::Isometry3d retract(const Eigen::Isometry3d& T_map_sensor, const Eigen::Vector3d& centroid_sensor,
                          const Vector6d& xi) {
  const Eigen::Vector3d c = T_map_sensor * centroid_sensor;
  const Eigen::Isometry3d step = expSe3(xi);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = step.linear() * T_map_sensor.linear();
  T.translation() = step.linear() * (T_map_sensor.translation() - c) + step.translation() + c;
  // Thousands of products drift off SO(3): project back by the quaternion.
  T.linear() = Eigen::Quaterniond(T.linear()).normalized().toRotationMatrix();
  return T;
}

}  // namespace ttsdf
