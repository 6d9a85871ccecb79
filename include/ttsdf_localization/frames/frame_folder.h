#pragma once
// Readers of depth-frame folders: frame-NNNNNN.depth.png (16 bit) + frame-NNNNNN.pose.txt +
// camera-intrinsics.txt, the 7-Scenes / 3DMatch layout.

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "ttsdf_localization/frames/depth_image.h"

namespace ttsdf {

/// 16-bit grey PNG or binary PGM; 0 and 65535 are "no reading". Throws std::runtime_error naming the file.
DepthImage readDepthImage(const std::string& path, double units_per_metre);

/// 4x4 row-major pose, re-orthonormalised. Throws std::runtime_error naming the file (missing, NaN, not a
/// rotation).
Eigen::Isometry3d readPose(const std::string& path);
/// 4x4 row-major, enough digits to read the same numbers back. Throws std::runtime_error naming the file.
void writePose(const std::string& path, const Eigen::Isometry3d& T);

struct FrameEntry {
  int index = 0;
  std::string depth_path, pose_path;
};

class FrameFolder {
 public:
  /// Throws std::runtime_error: no such folder, no frames, no intrinsics (camera-intrinsics.txt or
  /// intrinsics.K.txt), or frames without any pose file.
  explicit FrameFolder(const std::string& path, double units_per_metre = 1000.0);

  const CameraIntrinsics& intrinsics() const {
    return intrinsics_;
  }  ///< width and height from the first readable image
  const std::vector<FrameEntry>& frames() const {
    return frames_;
  }  ///< rising index; only frames that have a pose file
  /// Frames whose index % every == offset. Throws std::invalid_argument unless 0 <= offset < every.
  std::vector<FrameEntry> select(int every, int offset) const;
  DepthImage depth(const FrameEntry& frame) const {
    return readDepthImage(frame.depth_path, units_per_metre_);
  }
  Eigen::Isometry3d pose(const FrameEntry& frame) const { return readPose(frame.pose_path); }

 private:
  double units_per_metre_;
  CameraIntrinsics intrinsics_;
  std::vector<FrameEntry> frames_;
};

}  // namespace ttsdf
