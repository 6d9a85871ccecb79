#include "ttsdf_localization/localization/localization_types.h"

namespace ttsdf {

const char* name(LocalizerState state) {
  switch (state) {
    case LocalizerState::kNoMap:
      return "no_map";
    case LocalizerState::kWaitingForPose:
      return "waiting_for_pose";
    case LocalizerState::kTracking:
      return "tracking";
    case LocalizerState::kDegraded:
      return "degraded";
    case LocalizerState::kLost:
      return "lost";
    case LocalizerState::kRelocalizing:
      return "relocalizing";
  }
  return "unknown";
}

const char* name(RefusalReason reason) {
  switch (reason) {
    case RefusalReason::kNone:
      return "none";
    case RefusalReason::kNotConverged:
      return "not_converged";
    case RefusalReason::kTooFewPoints:
      return "too_few_points";
    case RefusalReason::kOutsideMap:
      return "outside_map";
    case RefusalReason::kResidual:
      return "residual";
    case RefusalReason::kInliers:
      return "inliers";
    case RefusalReason::kJump:
      return "jump";
    case RefusalReason::kDegenerate:
      return "degenerate";
    case RefusalReason::kAmbiguous:
      return "ambiguous";
    case RefusalReason::kLowScore:
      return "low_score";
    case RefusalReason::kCancelled:
      return "cancelled";
    case RefusalReason::kNoStartPose:
      return "no_start_pose";
    case RefusalReason::kNoMap:
      return "no_map";
    case RefusalReason::kOldStamp:
      return "old_stamp";
    case RefusalReason::kNoPrior:
      return "no_prior";
    case RefusalReason::kNoScan:
      return "no_scan";
  }
  return "unknown";
}

}  // namespace ttsdf
