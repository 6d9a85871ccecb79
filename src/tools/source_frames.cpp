#include "source_frames.h"

#include <cmath>
#include <stdexcept>

namespace ttsdf {

std::string withFile(const FrameEntry& frame, std::string reason) {
  const bool named = reason.find(frame.depth_path) != std::string::npos ||
                     (!frame.pose_path.empty() && reason.find(frame.pose_path) != std::string::npos);
  return named ? reason : "'" + frame.depth_path + "': " + reason;
}

std::string strayPoseReason(const FrameEntry& frame, double distance) {
  return "'" + (frame.pose_path.empty() ? frame.depth_path : frame.pose_path) + "': the pose lies " +
         std::to_string(std::lround(distance)) + " m from the middle of all others";
}

FrameCheck checkAgreement(const BuildArguments& a, const FrameFolder& folder, const FrameFolderOptions& given,
                          const std::vector<FrameEntry>& frames, Progress& progress) {
  progress.update("comparing frames", 0.0);
  FrameCheckOptions options;
  options.min_depth = a.fusion.min_depth;
  options.max_depth = a.fusion.max_depth;
  const FrameCheck check = checkFrames(folder, given, frames, options);
  using Verdict = FrameCheck::Verdict;
  if (check.verdict() == Verdict::kNonsense && !a.trust_frames) {
    throw std::runtime_error("frame folder '" + a.frames + "': " + check.message() +
                             " (--trust-frames builds anyway)");
  }
  if (check.verdict() == Verdict::kDoubtful || check.verdict() == Verdict::kNonsense) {
    progress.warn(check.message());
  }
  return check;
}

}  // namespace ttsdf
