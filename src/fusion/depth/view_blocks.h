#pragma once
// Which blocks of the volume one depth image says something about.

#include <Eigen/Geometry>
#include <vector>

#include "block_update.h"
#include "depth_pyramid.h"

namespace ttsdf {

/// Projection of voxels into one camera, by index.
struct VoxelCamera {
  VoxelCamera(const CameraIntrinsics& intrinsics, const Eigen::Isometry3d& T_map_camera, double voxel_size);

  Eigen::Vector3d position(const openvdb::Coord& ijk) const {
    return axes * Eigen::Vector3d(ijk.x(), ijk.y(), ijk.z()) + origin;
  }

  CameraIntrinsics k;
  Eigen::Isometry3d T_map_camera;
  double voxel_size;       ///< [m]
  Eigen::Matrix3d axes;    ///< steps of one voxel along i, j, k in the camera frame [m]
  Eigen::Vector3d origin;  ///< voxel (0, 0, 0) in the camera frame [m]
  double near_depth;       ///< voxels nearer than this are not projected [m]
};

/// Blocks of the view in a fixed order; runs on the calling TBB arena. Wholly free blocks only where `carve`.
std::vector<BlockVisit> blocksInView(const VoxelCamera& camera, const DepthPyramid& pyramid, bool carve);

}  // namespace ttsdf
