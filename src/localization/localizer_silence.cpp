// No scan comes: time alone changes the state.

#include <algorithm>
#include <cstdio>

#include "ttsdf_localization/localization/localizer.h"

namespace ttsdf {

namespace {
constexpr double kMissedScans = 3.0;  // a slow camera is not a dead one
}

std::optional<LocalizationUpdate> Localizer::withoutScans(double seconds, double usual_interval) {
  if (state_ != LocalizerState::kTracking && state_ != LocalizerState::kDegraded) return std::nullopt;
  const auto& recovery = options_.recovery;
  const double patience = std::max(recovery.lost_after_seconds, kMissedScans * usual_interval);
  if (recovery.lost_without_scans && seconds >= std::max(recovery.coast_seconds, patience)) {
    stopConfirming();
    becomeLost(0);
  } else if (state_ == LocalizerState::kTracking && seconds >= patience) {
    state_ = LocalizerState::kDegraded;
  } else {
    return std::nullopt;
  }
  LocalizationUpdate update;
  update.stamp = motion_.lastStamp() + seconds;
  update.reason = RejectionReason::kNoScan;
  char text[64];
  std::snprintf(text, sizeof(text), "no usable scan for %.1f s", seconds);
  update.message = text;
  return withState(update);
}

}  // namespace ttsdf
