#pragma once
// What perfect, noise-free observation leaves of a place whose distances are known: simulated buildings as
// volumes, without rendering thousands of frames.

#include <functional>

#include "ttsdf_localization/fusion/tsdf_volume.h"
#include "ttsdf_localization/tensor/dense_tensor.h"

namespace ttsdf {

/// Fills the signed distances [m] of the samples begin + [0, size) of the lattice voxel_size * (i, j, k),
/// first index fastest. Called from several threads at once.
using DistanceSampler = std::function<void(const Eigen::Array3i& begin, const Dims& size, float* distances)>;

/// Of the samples begin + [0, size) those within the truncation are band (weight 1), those in front of it
/// free, those behind it unknown, as is everything else. Throws std::invalid_argument for an extent below 1
/// or bad options.
TsdfVolume idealVolume(const DistanceSampler& distances, const Eigen::Array3i& begin, const Dims& size,
                       const FusionOptions& options);

}  // namespace ttsdf
