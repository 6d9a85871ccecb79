#pragma once
// Folders of depth frames with poses, as the data sets of this field have them.

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "ttsdf_localization/frames/depth_image.h"

namespace ttsdf {

/// 16-bit grey PNG or binary PGM; 0 and 65535 are "no reading". Throws std::runtime_error naming the file.
DepthImage readDepthImage(const std::string& path, double units_per_metre);
/// Width and height by the file's header alone; zeros for what is no PNG or PGM.
Eigen::Array2i depthImageSize(const std::string& path);

/// 4x4 (or 3x4) row-major pose, re-orthonormalised. Throws std::runtime_error naming the file (missing, NaN,
/// not a rotation).
Eigen::Isometry3d readPose(const std::string& path);
/// 4x4 row-major, enough digits to read the same numbers back. Throws std::runtime_error naming the file.
void writePose(const std::string& path, const Eigen::Isometry3d& T);

struct FrameEntry {
  int index = 0;
  std::string depth_path;
  std::string pose_path;  ///< a file of its own, where the layout has one per frame
  double stamp = 0.0;     ///< [s]; 0 where the layout has none
  std::optional<Eigen::Isometry3d>
      pose;  ///< as the folder's trajectory has it, where the layout has one file for all
};

/// What may be said of a folder that it does not say itself, or says wrongly.
struct FrameFolderOptions {
  double units_per_metre = 0.0;        ///< of the depth images; 0: as the layout has it (1000 without)
  bool poses_world_to_camera = false;  ///< the poses map the world to the camera
  bool opengl_axes = false;            ///< camera axes x right, y up, z backward (OpenCV: y down, z forward)
  char mirrored_axis =
      0;  ///< 'x', 'y' or 'z': left-handed poses, right-handed with this axis the other way round
  char mirrored_positions = 0;  ///< 'x', 'y' or 'z': of the positions alone, whose rotations are right
  /// World axis and camera axis ("yx") of the rotations alone, whose positions are right; empty: none.
  std::string mirrored_rotations;
  bool quaternions_w_first = false;           ///< the poses' quaternions are w x y z
  double pose_scale = 1.0;                    ///< metres per unit of the poses' translations
  double stamp_shift = 0.0;                   ///< added to the images' stamps before poses are looked up [s]
  std::optional<Eigen::Vector4d> intrinsics;  ///< fx, fy, cx, cy
};

/// Layouts that are found out: 7-Scenes / 3DMatch, BundleFusion, ScanNet, TUM RGB-D, Redwood / Open3D,
/// ICL-NUIM, Replica; clouds with poses in these layouts.
class FrameFolder {
 public:
  /// Throws std::runtime_error: no such folder, no known layout, no intrinsics or nonsense ones, frames
  /// without any pose.
  explicit FrameFolder(const std::string& path, const FrameFolderOptions& options);
  explicit FrameFolder(const std::string& path, double units_per_metre = 1000.0);

  /// Of the size that most images have.
  const CameraIntrinsics& intrinsics() const { return intrinsics_; }
  /// Rising index; only frames that have a pose.
  const std::vector<FrameEntry>& frames() const { return frames_; }
  /// Frames whose index % every == offset. Throws std::invalid_argument unless 0 <= offset < every.
  std::vector<FrameEntry> select(int every, int offset) const;
  DepthImage depth(const FrameEntry& frame) const {
    return readDepthImage(frame.depth_path, units_per_metre_);
  }
  /// T_map_camera.
  Eigen::Isometry3d pose(const FrameEntry& frame) const;
  /// Clouds in the images' place: `depth_path` names a cloud file (readers/cloud_file.h), and there are no
  /// intrinsics.
  bool holdsClouds() const { return clouds_; }
  /// The poses come from quaternions.
  bool hasQuaternions() const { return quaternions_; }
  double unitsPerMetre() const { return units_per_metre_; }
  /// One line: layout, images, camera, units, and what was left out.
  const std::string& description() const { return description_; }
  const std::string& layout() const { return layout_; }

 private:
  void settleSize(const std::string& path, const Eigen::Array2i& intended);

  FrameFolderOptions options_;
  double units_per_metre_ = 1000.0;
  CameraIntrinsics intrinsics_;
  std::vector<FrameEntry> frames_;
  bool clouds_ = false, quaternions_ = false;
  std::string layout_, description_;
};

}  // namespace ttsdf
