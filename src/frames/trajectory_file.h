#pragma once
// Poses of many frames in one file.

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "ttsdf_localization/frames/frame_folder.h"

namespace ttsdf {

struct StampedPose {
  double stamp = 0.0;  ///< [s], or the number of the frame
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
};

/// All numbers of a text, line by line; comments from '#' on and empty lines are left out. Throws
/// std::runtime_error naming the file and line for a word that is no number, if `strict`; else such lines are
/// left out.
std::vector<std::vector<double>> readRows(const std::string& path, bool strict = true);

/// Poses of one file by their numbers.
struct PoseList {
  std::map<int, Eigen::Isometry3d> poses;
  int first = 0, last = -1;  ///< numbers of the file, with those of lost frames, that have no pose
  std::size_t count = 0;     ///< with lost frames
  bool quaternions = false;
};

/// Lines `stamp tx ty tz qx qy qz qw` (TUM, ICL-NUIM), rising stamps. Throws std::runtime_error.
std::vector<StampedPose> readStampedPoses(const std::string& path, const FrameFolderOptions& options);
/// Poses `id id count` + 4x4 each (Redwood, Open3D), by the first id.
PoseList readPoseLog(const std::string& path);
/// A pose a line: 16 numbers (Replica), 12 (KITTI) or `tx ty tz qx qy qz qw` (slambook), by line from 0.
PoseList readPoseLines(const std::string& path, const FrameFolderOptions& options);

/// The pose at a stamp between two others, interpolated. Nothing if it lies outside or the two are more than
/// `gap` apart.
std::optional<Eigen::Isometry3d> poseAt(const std::vector<StampedPose>& poses, double stamp, double gap);

}  // namespace ttsdf
