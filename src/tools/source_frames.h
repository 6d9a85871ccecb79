#pragma once
// Frames as a program takes them from a folder: which it leaves out, and whether they agree.

#include <string>
#include <vector>

#include "ttsdf_localization/frames/frame_check.h"
#include "ttsdf_localization/tools/build_sources.h"

namespace ttsdf {

/// Why a frame is left out, with its file if the reason does not name it.
std::string withFile(const FrameEntry& frame, std::string reason);

/// `distance` from the middle of all others [m].
std::string strayPoseReason(const FrameEntry& frame, double distance);

/// Before an hour is spent. Doubts go to `progress`; throws std::runtime_error if the frames contradict one
/// another and --trust-frames is not given.
FrameCheck checkAgreement(const BuildArguments& a, const FrameFolder& folder, const FrameFolderOptions& given,
                          const std::vector<FrameEntry>& frames, Progress& progress);

}  // namespace ttsdf
