#pragma once
// Validators: is a registered scan accepted, and if not, why.

#include <string>

#include "ttsdf_localization/localization/localization_types.h"
#include "ttsdf_localization/localization/localizer_options.h"

namespace ttsdf {

struct Rejection {
  RejectionReason reason = RejectionReason::kNone;
  std::string message;  ///< what, got, wanted
  explicit operator bool() const { return reason != RejectionReason::kNone; }
};

/// Why the registration itself gave up; kNone if it did not.
Rejection checkTermination(const RegistrationResult& result);

/// Residual, inliers, share outside the map, degeneracy. `min_inlier_ratio` is one of the two in the options.
Rejection checkFit(const RegistrationResult& result, const GateOptions& options, double min_inlier_ratio);
/// The same after a search, where a wrong place may fit a little: most of the scan has to be explained.
Rejection checkFitAfterSearch(const RegistrationResult& result, const GateOptions& options,
                              double min_inlier_ratio);

/// Whether the score is what a place that was found without a prior has to have.
Rejection checkScore(const RegistrationResult& result, double most);

/// Distance of the pose, weighed against its prior, from that prior: what slides along a corridor is no jump.
Rejection checkJump(const PoseError& jump, const GateOptions& options);

/// True if the scan does not contradict the pose but has no information about it: too few points, or none
/// where the map knows anything.
bool isUninformative(RejectionReason reason);

}  // namespace ttsdf
