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

const char* name(RejectionReason reason) {
  switch (reason) {
    case RejectionReason::kNone:
      return "none";
    case RejectionReason::kNotConverged:
      return "not_converged";
    case RejectionReason::kTooFewPoints:
      return "too_few_points";
    case RejectionReason::kOutsideMap:
      return "outside_map";
    case RejectionReason::kResidual:
      return "residual";
    case RejectionReason::kInliers:
      return "inliers";
    case RejectionReason::kJump:
      return "jump";
    case RejectionReason::kDegenerate:
      return "degenerate";
    case RejectionReason::kAmbiguous:
      return "ambiguous";
    case RejectionReason::kLowScore:
      return "low_score";
    case RejectionReason::kCancelled:
      return "cancelled";
    case RejectionReason::kNoStartPose:
      return "no_start_pose";
    case RejectionReason::kNoMap:
      return "no_map";
    case RejectionReason::kOldStamp:
      return "old_stamp";
    case RejectionReason::kNoPrior:
      return "no_prior";
    case RejectionReason::kNoScan:
      return "no_scan";
  }
  return "unknown";
}

}  // namespace ttsdf
