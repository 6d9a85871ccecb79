#pragma once
// The last good pose, kept in a small text file over restarts.

#include <optional>
#include <string>

#include "ttsdf_localization/localization/localization_types.h"

namespace ttsdf {

/// Replaces the file in one step. Throws std::runtime_error naming the path.
void savePose(const std::string& path, const std::string& frame_id, const PoseGuess& pose);

/// Empty if there is no file. Throws std::runtime_error for a file that is no pose or of another frame.
std::optional<PoseGuess> loadPose(const std::string& path, const std::string& frame_id);

}  // namespace ttsdf
