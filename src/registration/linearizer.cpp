#include "linearizer.h"

#include <algorithm>
#include <cstring>

#include "../tensor/vectorize.h"

namespace ttsdf {

namespace {

constexpr int kChunkPoints = 256;
constexpr int kLanes = 16;  // partial sums kept apart: vectorisable without reordering
constexpr float kNever = 1e30f;
constexpr int kSums = 21 + 6 + 5;  // H, g, cost, score, inlier squares, weight, squares

struct Chunk {
  int size;
  alignas(64) float lx[kChunkPoints], ly[kChunkPoints], lz[kChunkPoints];  // R p: lever arms
  alignas(64) float x[kChunkPoints], y[kChunkPoints], z[kChunkPoints];     // map frame
  alignas(64) float value[kChunkPoints], gx[kChunkPoints], gy[kChunkPoints], gz[kChunkPoints];
  alignas(64) PointState state[kChunkPoints];
  alignas(64) float weight[kChunkPoints], residual[kChunkPoints], loss[kChunkPoints], score[kChunkPoints];
  alignas(64) float inlier[kChunkPoints], valid[kChunkPoints];
  const float* trust;  // of the points, by range
  alignas(64) float jacobian[6][kChunkPoints];
  float ray[3];  // from the sensor to the pivot, map frame
};

struct Pose {
  float R[3][3];
  float t[3];
};

TTSDF_VECTORIZE void transformChunk(const float* px, const float* py, const float* pz, const Pose& pose,
                                    Chunk& c) {
  const auto& R = pose.R;
  for (int n = 0; n < c.size; ++n) {
    c.lx[n] = R[0][0] * px[n] + R[0][1] * py[n] + R[0][2] * pz[n];
    c.ly[n] = R[1][0] * px[n] + R[1][1] * py[n] + R[1][2] * pz[n];
    c.lz[n] = R[2][0] * px[n] + R[2][1] * py[n] + R[2][2] * pz[n];
    c.x[n] = c.lx[n] + pose.t[0];
    c.y[n] = c.ly[n] + pose.t[1];
    c.z[n] = c.lz[n] + pose.t[2];
  }
}

struct KernelConstants {
  float scale2;   // squared Geman-McClure scale
  float robust;   // 1 or 0
  float inlier2;  // squared inlier distance
  float score2;   // squared scale of the score
  float limit;    // 1: limit the gradient to unit length
  float facing;   // squared cosine between ray and gradient above which a surface is seen from behind
  float deep;     // value below which a point is deep inside matter
};

/// 1 where the surface next to a point may be what the sensor saw. The gradient points to the free side, so a
/// ray along it would have come through matter; deep inside it has to point to the sensor.
inline float facesSensor(const Chunk& c, int n, const KernelConstants& k) {
  const float rx = c.lx[n] + c.ray[0], ry = c.ly[n] + c.ray[1], rz = c.lz[n] + c.ray[2];
  const float along = rx * c.gx[n] + ry * c.gy[n] + rz * c.gz[n];
  const float most = (c.value[n] < k.deep ? -k.facing : k.facing) * (rx * rx + ry * ry + rz * rz);
  return along * __builtin_fabsf(along) > most ? 0.0f : 1.0f;
}

/// Residuals, weights and Jacobian rows J = grad^T [-x^ | I] (x relative to the pivot); zero for points that
/// say nothing.
TTSDF_VECTORIZE void residualChunk(Chunk& c, const KernelConstants& k) {
  for (int n = 0; n < c.size; ++n) {
    const float valid = c.state[n] == PointState::kValid ? facesSensor(c, n, k) : 0.0f;
    const float r = c.value[n], r2 = r * r;
    const float q = k.scale2 / (r2 + k.scale2);
    c.valid[n] = valid;
    c.weight[n] = valid * c.trust[n] * (k.robust * q * q + (1.0f - k.robust));
    c.loss[n] = valid * c.trust[n] * (k.robust * (1.0f - q) + (1.0f - k.robust) * r2);
    c.score[n] = valid * r2 / (r2 + k.score2);
    c.inlier[n] = valid * (r2 < k.inlier2 ? 1.0f : 0.0f);
    c.residual[n] = r;
    const float g2 = c.gx[n] * c.gx[n] + c.gy[n] * c.gy[n] + c.gz[n] * c.gz[n];
    const float shrink = g2 > 1.0f ? 1.0f / __builtin_sqrtf(g2) : 1.0f;
    const float s = k.limit * shrink + (1.0f - k.limit);
    const float gx = s * c.gx[n], gy = s * c.gy[n], gz = s * c.gz[n];
    c.jacobian[0][n] = c.ly[n] * gz - c.lz[n] * gy;
    c.jacobian[1][n] = c.lz[n] * gx - c.lx[n] * gz;
    c.jacobian[2][n] = c.lx[n] * gy - c.ly[n] * gx;
    c.jacobian[3][n] = gx;
    c.jacobian[4][n] = gy;
    c.jacobian[5][n] = gz;
  }
  const int padded = (c.size + kLanes - 1) / kLanes * kLanes;
  for (int n = c.size; n < padded; ++n) {
    c.weight[n] = c.residual[n] = c.loss[n] = c.score[n] = c.inlier[n] = c.valid[n] = 0.0f;
    for (auto& row : c.jacobian) row[n] = 0.0f;
  }
}

/// Sums of a chunk, kLanes partial sums each.
TTSDF_VECTORIZE void sumChunk(const Chunk& c, float (*sums)[kLanes]) {
  for (int n = 0; n < c.size; n += kLanes) {
    int s = 0;
    for (int a = 0; a < 6; ++a) {
      float wj[kLanes];
      for (int l = 0; l < kLanes; ++l) wj[l] = c.weight[n + l] * c.jacobian[a][n + l];
      for (int b = 0; b <= a; ++b, ++s) {
        for (int l = 0; l < kLanes; ++l) sums[s][l] += wj[l] * c.jacobian[b][n + l];
      }
      for (int l = 0; l < kLanes; ++l) sums[21 + a][l] += wj[l] * c.residual[n + l];
    }
    for (int l = 0; l < kLanes; ++l) {
      sums[27][l] += c.loss[n + l];
      sums[28][l] += c.score[n + l];
      sums[29][l] += c.inlier[n + l] * c.residual[n + l] * c.residual[n + l];
      sums[30][l] += c.weight[n + l];
      sums[31][l] += c.valid[n + l] * c.residual[n + l] * c.residual[n + l];
    }
  }
}

Pose toPose(const Eigen::Isometry3d& T, const Eigen::Vector3d& centroid) {
  Pose pose{};
  const Eigen::Vector3d t = T * centroid;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      pose.R[row][column] = static_cast<float>(T.linear()(row, column));
    pose.t[row] = static_cast<float>(t[row]);
  }
  return pose;
}

void addChunk(const Chunk& chunk, const float (*sums)[kLanes], double* total, NormalEquations& out) {
  for (int s = 0; s < kSums; ++s) {
    float lanes = 0.0f;
    for (int l = 0; l < kLanes; ++l) lanes += sums[s][l];
    total[s] += static_cast<double>(lanes);
  }
  for (int n = 0; n < chunk.size; ++n) {
    out.valid += chunk.valid[n] > 0.0f ? 1 : 0;
    out.outside += chunk.state[n] == PointState::kOutside ? 1 : 0;
    out.behind += chunk.state[n] == PointState::kValid && chunk.valid[n] == 0.0f ? 1 : 0;
    out.inliers += chunk.inlier[n] > 0.0f ? 1 : 0;
  }
}

}  // namespace

NormalEquations linearize(const DistanceField& field, const ScanBuffer& scan, int count,
                          const Eigen::Isometry3d& T_map_sensor, const ResidualModel& model) {
  const Pose pose = toPose(T_map_sensor, scan.centroid());
  const auto squared = [](double v) { return static_cast<float>(v * v); };
  const KernelConstants constants{squared(model.scale),
                                  model.robust ? 1.0f : 0.0f,
                                  squared(model.inlier_distance),
                                  squared(model.score_scale),
                                  model.limit_gradient ? 1.0f : 0.0f,
                                  model.check_facing ? squared(kBehindCosine) : kNever,
                                  model.check_facing ? static_cast<float>(-kDeepInside) : -kNever};
  NormalEquations out;
  Chunk chunk;
  const Eigen::Vector3d ray = T_map_sensor.linear() * scan.centroid();
  for (int axis = 0; axis < 3; ++axis) chunk.ray[axis] = static_cast<float>(ray[axis]);
  double total[kSums] = {};
  for (int begin = 0; begin < count; begin += kChunkPoints) {
    chunk.size = std::min(kChunkPoints, count - begin);
    transformChunk(scan.x() + begin, scan.y() + begin, scan.z() + begin, pose, chunk);
    chunk.trust = scan.weight() + begin;
    field.evaluate(PointSpan{chunk.x, chunk.y, chunk.z, chunk.size},
                   SampleSpan{chunk.value, chunk.gx, chunk.gy, chunk.gz, chunk.state});
    residualChunk(chunk, constants);
    alignas(64) float sums[kSums][kLanes] = {};
    sumChunk(chunk, sums);
    addChunk(chunk, sums, total, out);
  }
  int s = 0;
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b <= a; ++b, ++s) out.H(a, b) = out.H(b, a) = total[s];
    out.g[a] = total[21 + a];
  }
  out.cost = total[27], out.score = total[28], out.inlier_squares = total[29], out.weight = total[30];
  out.squares = total[31];
  out.unknown = count - out.valid - out.outside - out.behind;
  return out;
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
