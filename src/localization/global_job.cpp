#include "ttsdf_localization/localization/localizer.h"

namespace ttsdf {

GlobalJob::GlobalJob(int id, std::shared_ptr<const DistanceField> field,
                     std::shared_ptr<const DistanceField> far, LocalizerScan scan,
                     std::optional<Eigen::Vector3d> gravity, const LocalizerOptions& options)
    : id_(id),
      field_(std::move(field)),
      far_(std::move(far)),
      scan_(std::move(scan)),
      gravity_(std::move(gravity)),
      registration_(options.registration),
      global_(options.global),
      map_down_(options.mapDown().normalized()) {
  result_.reason = TerminationReason::kCancelled;
}

void GlobalJob::run(const ProgressCallback& progress) {
  Registration registration(field_, registration_, far_);
  result_ = localizeGlobally(registration, scan_.points, gravity_, map_down_, global_, progress);
}

}  // namespace ttsdf
