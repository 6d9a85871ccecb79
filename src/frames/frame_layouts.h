#pragma once
// Which data set's layout a folder has, and what it says.

#include <optional>
#include <string>
#include <vector>

#include "ttsdf_localization/frames/frame_folder.h"

namespace ttsdf {

struct FrameLayout {
  std::string name;
  std::vector<FrameEntry> frames;             ///< with a pose, rising index
  bool quaternions = false;                   ///< its poses are written as such
  bool clouds = false;                        ///< clouds in the images' place: no intrinsics
  std::size_t images = 0;                     ///< with or without one
  std::optional<Eigen::Vector4d> intrinsics;  ///< fx, fy, cx, cy
  std::string intrinsics_source;              ///< file or "known of ..."
  Eigen::Array2i intended_size =
      Eigen::Array2i::Zero();  ///< of the images that the intrinsics belong to; 0: not said
  double units_per_metre = 1000.0;
};

/// Throws std::runtime_error naming the folder if it has none of the layouts, or the file that is broken.
FrameLayout findLayout(const std::string& folder, const FrameFolderOptions& options);

}  // namespace ttsdf
