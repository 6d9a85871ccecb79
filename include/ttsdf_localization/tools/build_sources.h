#pragma once
// What ttsdf_build reads: frames, meshes, clouds, volumes, octrees -> the uncompressed side of a map.

#include <string>
#include <vector>

#include "ttsdf_localization/agreement/frame_comparison.h"
#include "ttsdf_localization/mapping/map_builder.h"
#include "ttsdf_localization/tools/progress.h"

namespace ttsdf {

/// The command line.
struct BuildArguments {
  std::string frames, mesh, vdb, cloud, octomap, grid, output, report, save_vdb;
  std::string poses = "camera-to-world", camera_axes = "opencv", intrinsics;
  std::string mirror_poses = "none", quaternions = "xyzw";
  double depth_scale = 0.0, scale = 1.0, pose_scale = 1.0, stamp_shift = 0.0;
  std::string cloud_from = "inside";
  bool trust_frames = false;
  int every = 10, offset = 0;
  FusionOptions fusion;
  BuildOptions build;
};

/// What was read.
struct BuildSource {
  std::size_t frames = 0;
  std::vector<std::string> skipped;        ///< frames left out: why, each with its file
  std::vector<std::string> skipped_names;  ///< their files
  std::vector<int> indices;                ///< of the frames used
  std::vector<FrameDifference> differences;
  FrameAgreement agreement;
  double seconds = 0.0, comparing = 0.0;
};

/// The volume of frames, a cloud, a .vdb file or an octree. Throws std::runtime_error naming what cannot be
/// used.
TsdfVolume volumeFromSource(const BuildArguments& a, Progress& progress, BuildSource& source);

/// Reads the source that the arguments name and builds the map. Notes and warnings go to `progress`. Throws
/// std::runtime_error naming what cannot be used.
BuiltMap buildFromSource(const BuildArguments& a, Progress& progress, BuildSource& source);

}  // namespace ttsdf
