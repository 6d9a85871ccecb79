#pragma once
// Poses as a folder has them -> T_map_camera with OpenCV's axes.

#include "ttsdf_localization/frames/frame_folder.h"

namespace ttsdf {

inline Eigen::Vector3d mirrorOf(char axis) {
  Eigen::Vector3d mirror = Eigen::Vector3d::Ones();
  mirror[axis - 'x'] = -1.0;
  return mirror;
}

inline Eigen::Isometry3d corrected(Eigen::Isometry3d T, const FrameFolderOptions& options) {
  T.translation() *= options.pose_scale;
  if (options.poses_world_to_camera) T = T.inverse();
  if (options.mirrored_axis != 0) {
    const Eigen::Vector3d mirror = mirrorOf(options.mirrored_axis);
    T.linear() = mirror.asDiagonal() * T.linear() * mirror.asDiagonal();
    T.translation() = mirror.cwiseProduct(T.translation());
  }
  if (options.mirrored_positions != 0) {
    T.translation() = mirrorOf(options.mirrored_positions).cwiseProduct(T.translation());
  }
  if (options.mirrored_rotations.size() == 2) {
    T.linear() = mirrorOf(options.mirrored_rotations[0]).asDiagonal() * T.linear() *
                 mirrorOf(options.mirrored_rotations[1]).asDiagonal();
  }
  if (options.opengl_axes) {
    Eigen::Isometry3d turn = Eigen::Isometry3d::Identity();
    turn.linear() = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    T = T * turn;
  }
  return T;
}

}  // namespace ttsdf
