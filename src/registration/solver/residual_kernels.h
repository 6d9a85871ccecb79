#pragma once
// The inner loops of the registration: points to the map frame, residuals and Jacobian rows, sums of the
// normal equations. All are vectorised; a point that says nothing has weight 0, so that no loop branches.

#include "ttsdf_localization/field/distance_field.h"

namespace ttsdf {

constexpr int kChunkPoints = 256;
constexpr int kLanes = 16;  ///< partial sums kept apart, and what chunks are padded to
constexpr int kSums =
    21 + 6 + 5;  ///< H (lower triangle by rows), g, cost, score, inlier squares, weight, squares

struct ResidualChunk {
  int size;
  alignas(64) float lx[kChunkPoints], ly[kChunkPoints], lz[kChunkPoints];  ///< R p: lever arms
  alignas(64) float x[kChunkPoints], y[kChunkPoints], z[kChunkPoints];     ///< map frame
  alignas(64) float value[kChunkPoints], gx[kChunkPoints], gy[kChunkPoints], gz[kChunkPoints];
  alignas(64) PointState state[kChunkPoints];
  alignas(64) float valid[kChunkPoints], inlier[kChunkPoints];  ///< 0 or 1
  alignas(64) float weight[kChunkPoints], loss[kChunkPoints], score[kChunkPoints];
  alignas(64) float jacobian[6][kChunkPoints];
  const float* point_weight;  ///< of the points, by range
  float ray[3];               ///< from the sensor to the pivot, map frame
};

struct KernelPose {
  float R[3][3];
  float t[3];
};

struct KernelConstants {
  float scale2;   ///< squared Geman-McClure scale
  float robust;   ///< 1 or 0
  float inlier2;  ///< squared inlier distance
  float score2;   ///< squared scale of the score
  float limit;    ///< 1: limit the gradient to unit length
  float facing;   ///< squared cosine between ray and gradient above which a surface is seen from behind
  float deep;     ///< value below which a point is deep inside matter
};

struct KernelCounts {
  int valid = 0, inliers = 0, outside = 0, behind = 0;
};

/// Lever arms and places of the points at a pose.
void transformChunk(const float* px, const float* py, const float* pz, const KernelPose& pose,
                    ResidualChunk& chunk);

/// Weights, losses and Jacobian rows J = grad^T [-x^ | I] (x relative to the pivot); zero for points that say
/// nothing and for the padding.
void residualChunk(ResidualChunk& chunk, const KernelConstants& constants);

/// Adds the chunk's sums, kLanes partial sums each.
void sumChunk(const ResidualChunk& chunk, float (*sums)[kLanes]);

/// Adds the chunk's points by kind.
void countChunk(const ResidualChunk& chunk, KernelCounts& counts);

}  // namespace ttsdf
