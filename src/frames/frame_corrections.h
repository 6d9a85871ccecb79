#pragma once
// Poses as a folder has them -> T_map_camera with OpenCV's axes.

#include "ttsdf_localization/frames/frame_folder.h"

namespace ttsdf {

inline Eigen::Isometry3d corrected(Eigen::Isometry3d T, const FrameFolderOptions& options) {
  T.translation() *= options.pose_scale;
  if (options.poses_world_to_camera) T = T.inverse();
  if (options.opengl_axes) {
    Eigen::Isometry3d turn = Eigen::Isometry3d::Identity();
    turn.linear() = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    T = T * turn;
  }
  return T;
}

}  // namespace ttsdf
