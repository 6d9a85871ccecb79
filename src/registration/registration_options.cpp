#include "ttsdf_localization/registration/registration.h"
#include "ttsdf_localization/sensor/sensor_model.h"

namespace ttsdf {

const OptionTable<RegistrationOptions>& registrationOptionTable() {
  using O = RegistrationOptions;
  static const OptionTable<O> table =
      OptionTable<O>()
          .add("method", &O::method, {"robust", "gauss_newton"},
               "Levenberg-Marquardt with a robust kernel, or plain Gauss-Newton as in the paper")
          .add(
              "prior_translation_sigma", &O::prior_translation_sigma, 0.0, 1000.0, "m",
              "Standard deviation of a prior whose covariance nobody gives; 0: a quarter of the scan's range")
          .add("prior_rotation_sigma", &O::prior_rotation_sigma, 0.001, 3.2, "rad",
               "The same of its rotation")
          .add("max_iterations", &O::max_iterations, 1, 1000, "",
               "Evaluations of the scan at the most, but for a narrower kernel")
          .add("rotation_epsilon", &O::rotation_epsilon, 0.0, 0.1, "rad", "A step that turns less ...")
          .add("translation_epsilon", &O::translation_epsilon, 0.0, 0.1, "m",
               "... and moves less ends the iteration")
          .add("cost_epsilon", &O::cost_epsilon, 0.0, 0.1, "",
               "So does a step that lowers the cost by less than this share")
          .add("kernel_scale_start", &O::kernel_scale_start, 0.0, 100.0, "m",
               "Largest Geman-McClure scale; the first iterations start here or at the scan's own residual; "
               "0: "
               "twice the scan's radius")
          .add("kernel_scale_end", &O::kernel_scale_end, 0.0, 10.0, "m",
               "Geman-McClure scale of the first stage on all points; 0: as the inlier distance")
          .add("kernel_scale_least", &O::kernel_scale_least, 0.0, 10.0, "m",
               "The last stages narrow the kernel with the spread of the residuals, at most to this; 0: a "
               "fifth "
               "of a voxel; as kernel_scale_end: never")
          .add("inlier_distance", &O::inlier_distance, 0.0, 10.0, "m",
               "A point nearer to the surface is an inlier; 0: a fiftieth of the scan's range, but 1.25 "
               "voxels at the least and 5 at the most")
          .add("min_inlier_ratio", &O::min_inlier_ratio, 0.0, 1.0, "",
               "Share of inliers among the points in known space that a successful registration needs")
          .add("min_known_ratio", &O::min_known_ratio, 0.0, 1.0, "",
               "Share of points in known space that a registration needs")
          .add("min_confidence", &O::min_confidence, 0.0, 1.0, "",
               "A pose of which the verification is less confident is no success")
          .add("degenerate_threshold", &O::degenerate_threshold, 0.0, 0.5, "",
               "A direction with less of the information is reported as degenerate")
          .add("check_facing", &O::check_facing,
               "Points behind a mapped surface, as the scan sees it, carry no information; needs scans taken "
               "from the origin of their frame")
          .add("long_range", &O::long_range,
               "Pull scans in by a coarse distance field made when the map is loaded")
          .add("restarts", &O::restarts, 0, 1000, "",
               "Further starts around the prior when the first ones explain the scan badly, and before it is "
               "refused")
          .add("restart_score", &O::restart_score, 0.0, 1.0, "", "A score above this explains the scan badly")
          .add("sensor", &O::sensor, sensorNames(),
               "How points are weighed over range (method robust; the paper's weighs all alike)")
          .add("min_points", &O::min_points, 6, 100000, "", "Fewer usable points are refused")
          .add("max_points", &O::max_points, 6, 10000000, "", "More points are sub-sampled evenly");
  return table;
}

const char* name(TerminationReason reason) {
  switch (reason) {
    case TerminationReason::kConverged:
      return "converged";
    case TerminationReason::kMaxIterations:
      return "max_iterations";
    case TerminationReason::kTooFewPoints:
      return "too_few_points";
    case TerminationReason::kOutsideMap:
      return "outside_map";
    case TerminationReason::kDegenerate:
      return "degenerate";
    case TerminationReason::kAmbiguous:
      return "ambiguous";
    case TerminationReason::kLowScore:
      return "low_score";
    case TerminationReason::kUnsure:
      return "unsure";
    case TerminationReason::kCancelled:
      return "cancelled";
  }
  return "unknown";
}

}  // namespace ttsdf
