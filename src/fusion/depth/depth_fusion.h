#pragma once

#include "ttsdf_localization/fusion/tsdf_volume_grids.h"

namespace ttsdf {

/// Projective fusion of one depth image; arguments are checked by the caller. Runs on the calling TBB arena.
///
/// The view frustum is divided into blocks from coarse to fine. Ranges of depth over a block's pixels tell
/// blocks that are wholly free (one tile) and blocks that nothing is said about (skipped) from the few that
/// hold surface or the border of the view, which are visited voxel by voxel.
void fuseDepthImage(TsdfVolume::Grids& grids, const FusionOptions& options, const DepthImage& image,
                    const CameraIntrinsics& intrinsics, const Eigen::Isometry3d& T_map_camera);

}  // namespace ttsdf
