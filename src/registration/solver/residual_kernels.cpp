#include "residual_kernels.h"

#include "../../tensor/vectorize.h"

namespace ttsdf {

namespace {

// Of known width, so that sums stay in registers. On smaller machines the compiler splits them.
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float)), may_alias));

inline __attribute__((always_inline)) const Lanes& lanes(const float* p) {
  return *reinterpret_cast<const Lanes*>(p);
}

/// Row A of H and element A of g.
template <int A>
inline __attribute__((always_inline)) void sumRow(const ResidualChunk& chunk, float (*sums)[kLanes]) {
  constexpr int kFirst = A * (A + 1) / 2;
  Lanes row[A + 1] = {}, gradient = {};
  for (int n = 0; n < chunk.size; n += kLanes) {
    const Lanes weighed = lanes(chunk.weight + n) * lanes(chunk.jacobian[A] + n);
    for (int b = 0; b <= A; ++b) row[b] += weighed * lanes(chunk.jacobian[b] + n);
    gradient += weighed * lanes(chunk.value + n);
  }
  for (int b = 0; b <= A; ++b) *reinterpret_cast<Lanes*>(sums[kFirst + b]) += row[b];
  *reinterpret_cast<Lanes*>(sums[21 + A]) += gradient;
}

}  // namespace

TTSDF_VECTORIZE void transformChunk(const float* px, const float* py, const float* pz, const KernelPose& pose,
                                    ResidualChunk& c) {
  const KernelPose T = pose;
  const int size = c.size;
  TTSDF_INDEPENDENT
  for (int n = 0; n < size; ++n) {
    const float x = px[n], y = py[n], z = pz[n];
    const float lx = T.R[0][0] * x + T.R[0][1] * y + T.R[0][2] * z;
    const float ly = T.R[1][0] * x + T.R[1][1] * y + T.R[1][2] * z;
    const float lz = T.R[2][0] * x + T.R[2][1] * y + T.R[2][2] * z;
    c.lx[n] = lx, c.ly[n] = ly, c.lz[n] = lz;
    c.x[n] = lx + T.t[0], c.y[n] = ly + T.t[1], c.z[n] = lz + T.t[2];
  }
}

TTSDF_VECTORIZE void residualChunk(ResidualChunk& c, const KernelConstants& constants) {
  const KernelConstants k = constants;
  const int size = c.size;
  const float ray_x = c.ray[0], ray_y = c.ray[1], ray_z = c.ray[2];
  const float* const point_weight = c.point_weight;
  TTSDF_INDEPENDENT
  for (int n = 0; n < size; ++n) {
    // The gradient points to the free side, so a ray along it would have come through matter; deep inside it
    // has to point to the sensor.
    const float rx = c.lx[n] + ray_x, ry = c.ly[n] + ray_y, rz = c.lz[n] + ray_z;
    const float along = rx * c.gx[n] + ry * c.gy[n] + rz * c.gz[n];
    const float most = (c.value[n] < k.deep ? -k.facing : k.facing) * (rx * rx + ry * ry + rz * rz);
    const float faces = along * __builtin_fabsf(along) > most ? 0.0f : 1.0f;
    c.valid[n] = c.state[n] == PointState::kValid ? faces : 0.0f;
  }
  TTSDF_INDEPENDENT
  for (int n = 0; n < size; ++n) {
    const float valid = c.valid[n], weight = valid * point_weight[n], r = c.value[n], r2 = r * r;
    const float q = k.scale2 / (r2 + k.scale2);
    c.weight[n] = weight * (k.robust * q * q + (1.0f - k.robust));
    c.loss[n] = weight * (k.robust * (1.0f - q) + (1.0f - k.robust) * r2);
    c.score[n] = valid * r2 / (r2 + k.score2);
    c.inlier[n] = r2 < k.inlier2 ? valid : 0.0f;
  }
  TTSDF_INDEPENDENT
  for (int n = 0; n < size; ++n) {
    const float g2 = c.gx[n] * c.gx[n] + c.gy[n] * c.gy[n] + c.gz[n] * c.gz[n];
    const float longer = g2 > 1.0f ? g2 : 1.0f;
    const float s = k.limit / __builtin_sqrtf(longer) + (1.0f - k.limit);
    const float gx = s * c.gx[n], gy = s * c.gy[n], gz = s * c.gz[n];
    c.jacobian[0][n] = c.ly[n] * gz - c.lz[n] * gy;
    c.jacobian[1][n] = c.lz[n] * gx - c.lx[n] * gz;
    c.jacobian[2][n] = c.lx[n] * gy - c.ly[n] * gx;
    c.jacobian[3][n] = gx;
    c.jacobian[4][n] = gy;
    c.jacobian[5][n] = gz;
  }
  const int padded = (size + kLanes - 1) / kLanes * kLanes;
  for (int n = size; n < padded; ++n) {
    c.value[n] = c.weight[n] = c.loss[n] = c.score[n] = c.inlier[n] = c.valid[n] = 0.0f;
    for (auto& row : c.jacobian) row[n] = 0.0f;
  }
}

TTSDF_VECTORIZE void sumChunk(const ResidualChunk& c, float (*sums)[kLanes]) {
  sumRow<0>(c, sums);
  sumRow<1>(c, sums);
  sumRow<2>(c, sums);
  sumRow<3>(c, sums);
  sumRow<4>(c, sums);
  sumRow<5>(c, sums);
  Lanes loss = {}, score = {}, inlier_squares = {}, weight = {}, squares = {};
  for (int n = 0; n < c.size; n += kLanes) {
    const Lanes r2 = lanes(c.value + n) * lanes(c.value + n);
    loss += lanes(c.loss + n);
    score += lanes(c.score + n);
    inlier_squares += lanes(c.inlier + n) * r2;
    weight += lanes(c.weight + n);
    squares += lanes(c.valid + n) * r2;
  }
  const Lanes all[5] = {loss, score, inlier_squares, weight, squares};
  for (int s = 0; s < 5; ++s) *reinterpret_cast<Lanes*>(sums[27 + s]) += all[s];
}

TTSDF_VECTORIZE void countChunk(const ResidualChunk& c, KernelCounts& counts) {
  int valid = 0, inliers = 0, known = 0, outside = 0;
  for (int n = 0; n < c.size; ++n) {
    valid += c.valid[n] > 0.0f ? 1 : 0;
    inliers += c.inlier[n] > 0.0f ? 1 : 0;
  }
  for (int n = 0; n < c.size; ++n) {
    known += c.state[n] == PointState::kValid ? 1 : 0;
    outside += c.state[n] == PointState::kOutside ? 1 : 0;
  }
  counts.valid += valid, counts.inliers += inliers, counts.outside += outside;
  counts.behind += known - valid;
}

}  // namespace ttsdf
