#include "ttsdf_localization/localization/gates.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace ttsdf {

namespace {
template <class... Values>
std::string format(const char* pattern, Values... values) {
  char text[256];
  std::snprintf(text, sizeof(text), pattern, values...);
  return text;
}
}  // namespace

Rejection checkTermination(const RegistrationResult& result) {
  if (result.success) return {};
  // The prior is part of the estimate: it counts along directions that the scan does not fix. How many of
  // them there may be, and how much confidence is enough, are questions of the fit.
  if (result.reason == TerminationReason::kDegenerate && result.degenerate_directions > 0) return {};
  if (result.reason == TerminationReason::kUnsure) return {};
  switch (result.reason) {
    case TerminationReason::kTooFewPoints:
      return {RejectionReason::kTooFewPoints, format("only %d usable points in the scan", result.points)};
    case TerminationReason::kOutsideMap:
      return {
          RejectionReason::kOutsideMap,
          format(
              "%.0f %% of the points lie outside the map, %.0f %% in unknown space, %.0f %% behind surfaces",
              100.0 * result.outside_ratio, 100.0 * result.unknown_ratio, 100.0 * result.behind_ratio)};
    case TerminationReason::kDegenerate:
      return {RejectionReason::kDegenerate, "the scan does not fix the pose"};
    case TerminationReason::kAmbiguous:
      return {RejectionReason::kAmbiguous,
              format("two places look alike: scores %.3f and %.3f", result.score, result.runner_up_score)};
    case TerminationReason::kLowScore:
      return {RejectionReason::kLowScore,
              format("no place explains the scan: best score %.3f", result.score)};
    case TerminationReason::kCancelled:
      return {RejectionReason::kCancelled, "cancelled"};
    case TerminationReason::kUnsure:
    case TerminationReason::kConverged:
    case TerminationReason::kMaxIterations:
      break;
  }
  return {RejectionReason::kNotConverged,
          format("registration stopped (%s) after %d iterations, inlier ratio %.2f", name(result.reason),
                 result.iterations, result.inlier_ratio)};
}

Rejection checkFit(const RegistrationResult& result, const GateOptions& options, double min_inlier_ratio) {
  const double unmapped = result.outside_ratio + result.unknown_ratio + result.behind_ratio;
  // Written so that NaN is rejected.
  if (!(unmapped <= options.max_unmapped_ratio)) {
    return {RejectionReason::kOutsideMap,
            format("%.0f %% of the points lie outside the map, in unknown space or behind surfaces, at most "
                   "%.0f %% allowed (max_unmapped_ratio)",
                   100.0 * unmapped, 100.0 * options.max_unmapped_ratio)};
  }
  if (!(result.inlier_ratio >= min_inlier_ratio)) {
    return {RejectionReason::kInliers,
            format("inlier ratio %.2f, at least %.2f wanted", result.inlier_ratio, min_inlier_ratio)};
  }
  const double most =
      options.max_rms_residual > 0.0 ? options.max_rms_residual : 0.7 * result.inlier_distance;
  if (!(result.rms_residual <= most)) {
    return {
        RejectionReason::kResidual,
        format("rms residual %.3f m, at most %.3f m allowed (max_rms_residual)", result.rms_residual, most)};
  }
  // Of the directions that the scan fixes; the others are counted below.
  if (!(result.fit_confidence >= options.min_confidence)) {
    return {RejectionReason::kLowScore, format("confidence %.2f, at least %.2f wanted (min_confidence)",
                                               result.fit_confidence, options.min_confidence)};
  }
  if (result.degenerate_directions > options.max_degenerate_directions) {
    return {RejectionReason::kDegenerate,
            format("%d directions without information, at most %d allowed "
                   "(max_degenerate_directions)",
                   result.degenerate_directions, options.max_degenerate_directions)};
  }
  if (!result.T_map_sensor.matrix().allFinite())
    return {RejectionReason::kNotConverged, "the pose is not finite"};
  return {};
}

Rejection checkFitAfterSearch(const RegistrationResult& result, const GateOptions& options,
                              double min_inlier_ratio) {
  GateOptions gates = options;
  gates.max_unmapped_ratio = std::min(options.max_unmapped_ratio, options.recovery_unmapped_ratio);
  gates.min_confidence = std::max(options.min_confidence, options.recovery_confidence);
  if (Rejection rejection = checkFit(result, gates, min_inlier_ratio)) return rejection;
  if (result.behind_ratio <= options.recovery_behind_ratio) return {};
  return {RejectionReason::kInliers,
          format("%.0f %% of the points lie behind mapped surfaces, at most %.0f %% allowed "
                 "(recovery_behind_ratio)",
                 100.0 * result.behind_ratio, 100.0 * options.recovery_behind_ratio)};
}

Rejection checkScore(const RegistrationResult& result, double most) {
  if (result.score <= most) return {};
  return {RejectionReason::kLowScore,
          format("score %.2f, at most %.2f allowed for a place found without a prior (global/max_score)",
                 result.score, most)};
}

Rejection checkJump(const PoseError& jump, const GateOptions& options) {
  if (jump.translation <= options.max_jump_translation && jump.rotation <= options.max_jump_rotation)
    return {};
  return {RejectionReason::kJump,
          format("%.2f m and %.2f rad from the prior, at most %.2f m and %.2f rad allowed", jump.translation,
                 jump.rotation, options.max_jump_translation, options.max_jump_rotation)};
}

bool isUninformative(RejectionReason reason) {
  return reason == RejectionReason::kTooFewPoints || reason == RejectionReason::kOutsideMap;
}

}  // namespace ttsdf
