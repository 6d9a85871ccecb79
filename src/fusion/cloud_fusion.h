#pragma once

#include "ttsdf_localization/fusion/tsdf_volume_grids.h"

namespace ttsdf {

/// Fusion of a cloud ray by ray; points in the sensor frame, the pose is checked by the caller. Runs on the
/// calling TBB arena. Points that end in one voxel are bundled into one ray. Without a neighbourhood there is
/// no surface normal: distances are along the ray.
void fuseCloud(TsdfVolume::Grids& grids, const FusionOptions& options, const Eigen::Matrix3Xf& points,
               const Eigen::Isometry3d& T_map_sensor);

}  // namespace ttsdf
