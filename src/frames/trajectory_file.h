#pragma once
// Poses of many frames in one file.

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace ttsdf {

struct StampedPose {
  double stamp = 0.0;  ///< [s], or the number of the frame
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
};

/// All numbers of a text, line by line; comments from '#' on and empty lines are left out. Throws
/// std::runtime_error naming the file and line for a word that is no number, if `strict`; else such lines are
/// left out.
std::vector<std::vector<double>> readRows(const std::string& path, bool strict = true);

/// Lines `stamp tx ty tz qx qy qz qw` (TUM, ICL-NUIM), rising stamps. Throws std::runtime_error.
std::vector<StampedPose> readStampedPoses(const std::string& path);
/// Poses `id id count` + 4x4 each (Redwood, Open3D), by the first id.
std::map<int, Eigen::Isometry3d> readPoseLog(const std::string& path);
/// A pose a line: 16 numbers (Replica), 12 (KITTI) or `tx ty tz qx qy qz qw` (slambook), by line.
std::map<int, Eigen::Isometry3d> readPoseLines(const std::string& path);

/// The pose at a stamp between two others, interpolated. Nothing if it lies outside or the two are more than
/// `gap` apart.
std::optional<Eigen::Isometry3d> poseAt(const std::vector<StampedPose>& poses, double stamp, double gap);

}  // namespace ttsdf
