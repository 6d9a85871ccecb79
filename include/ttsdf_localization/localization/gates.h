#pragma once
// Validators: is a registered scan believed, and if not, why.

#include <string>

#include "ttsdf_localization/localization/localization_types.h"
#include "ttsdf_localization/localization/localizer_options.h"

namespace ttsdf {

struct Refusal {
  RefusalReason reason = RefusalReason::kNone;
  std::string message;  ///< what, got, wanted
  explicit operator bool() const { return reason != RefusalReason::kNone; }
};

/// Why the registration itself gave up; kNone if it did not.
Refusal checkTermination(const RegistrationResult& result);

/// Residual, inliers, share outside the map, degeneracy. `min_inlier_ratio` is one of the two in the options.
Refusal checkFit(const RegistrationResult& result, const GateOptions& options, double min_inlier_ratio);
/// The same after a search, where a wrong place may fit a little: most of the scan has to be explained.
Refusal checkFitAfterSearch(const RegistrationResult& result, const GateOptions& options,
                            double min_inlier_ratio);

/// Distance of the pose, weighed against its prior, from that prior: what slides along a corridor is no jump.
Refusal checkJump(const PoseError& jump, const GateOptions& options);

/// True if the scan contradicts nothing, it only says nothing: too few points, or none where the map knows
/// anything.
bool saysNothing(RefusalReason reason);

}  // namespace ttsdf
