#pragma once
// The camera's intrinsics as data sets write them, or as they are known of a camera.

#include <filesystem>
#include <string>

#include "frame_layouts.h"

namespace ttsdf {

/// Numbers of a camera matrix file, 3x3 or 4x4: fx, fy, cx, cy. Throws std::runtime_error.
Eigen::Vector4d readCameraMatrix(const std::string& path);

/// Looks for a file of intrinsics in the folder, below and above it; without one the layout stays as it is.
/// Throws std::runtime_error naming a file that is broken.
void findIntrinsics(const std::filesystem::path& folder, FrameLayout& layout);

/// Those of a data set's camera, for a layout that has none.
void useKnownIntrinsics(FrameLayout& layout, const Eigen::Vector4d& intrinsics, const Eigen::Array2i& size,
                        const std::string& source);

/// BundleFusion's info.txt: `m_calibrationDepthIntrinsic = 16 numbers`, `m_depthShift = 1000`.
void readBundleFusionInfo(const std::filesystem::path& path, FrameLayout& layout);

/// Of the camera that a folder's name says; `camera` stays empty where it says none.
Eigen::Vector4d tumIntrinsics(const std::string& name, std::string* camera);

}  // namespace ttsdf
