#pragma once
// Makes the data sets that need no download: folders of depth frames with exact poses, and views of models.

#include <string>
#include <vector>

#include "ttsdf_localization/frames/depth_image.h"
#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf {

/// Writes a folder that FrameFolder reads.
class FrameWriter {
 public:
  /// Makes the folder and writes the intrinsics. Throws std::runtime_error if that is not possible.
  FrameWriter(std::string folder, const CameraIntrinsics& intrinsics, double units_per_metre = 1000.0);
  /// Depths that 16 bits cannot hold become "no reading". Throws std::runtime_error if it cannot be written.
  void write(int index, const DepthImage& image, const Eigen::Isometry3d& T_map_camera) const;
  /// The exact pose beside a recorded one that is not: frame-NNNNNN.truth.txt.
  void writeTruth(int index, const Eigen::Isometry3d& T_map_camera) const;

 private:
  std::string stem(int index) const;

  std::string folder_;
  double units_per_metre_;
};

/// The mesh about the origin, its largest side `size` [m]. Throws std::invalid_argument for a mesh without
/// extent.
SurfaceMesh scaledTo(const SurfaceMesh& mesh, double size);

/// Camera poses spread over a sphere about the origin, all facing it, far enough that everything within
/// `radius` [m] of it is in the picture. Throws std::invalid_argument for a radius or a count not above 0.
std::vector<Eigen::Isometry3d> viewsAround(double radius, int count, const CameraIntrinsics& intrinsics);

}  // namespace ttsdf
