// What is said about a pose: whether it may be used, how sure it is, and how uncertain.

#include <algorithm>
#include <cmath>

#include "registration_impl.h"
#include "result.h"
#include "ttsdf_localization/geometry/pose_perturbation.h"
#include "verification/uncertainty.h"

namespace ttsdf {

namespace {

constexpr double kCovarianceClusters = 4.0;  // per radius of the scan
constexpr double kUnmeasured = 1e3;          // [m] standard deviation of what a scan does not measure
constexpr double kGridShift = 0.2;           // of a voxel, by which all surfaces are off

}  // namespace

Vector6d Registration::Impl::measuredInformation(const Verification& verification, const StageResult& stage,
                                                 const InformationAnalysis& info) const {
  Vector6d information = dataWeight(stage.equations, kernelSigma(scales_.last)) * info.share;
  for (std::size_t d = 0; d < 6; ++d) {
    const auto row = static_cast<Eigen::Index>(d);
    if (verification.without_information[d]) information[row] = 0.0;
    if (verification.without_evidence[d])
      information[row] = std::min(information[row], 1.0 / (unnoticedSigma() * unnoticedSigma()));
  }
  return information;
}

void Registration::Impl::restorePrior(const Verification& verification, StageResult& stage) const {
  if (verification.degenerate_directions == 0) return;
  const InformationAnalysis info = analyseInformation(stage.equations, scan_.radius());
  stage.T_map_sensor = fuseWithPrior(scan_, stage.T_map_sensor, info.directions,
                                     measuredInformation(verification, stage, info), prior_);
  stage.equations = linearize(*field_, scan_, scan_.fitted(), stage.T_map_sensor, model(scales_.last));
}

Verification Registration::Impl::verifyStage(const StageResult& stage, const HeldOut& held_out) const {
  return verify(*field_, scan_, held_out, stage.T_map_sensor, stage.equations, prior_, model(scales_.last),
                scales_, options_.degenerate_threshold);
}

void Registration::Impl::fillStatistics(const StageResult& stage, RegistrationResult& result) const {
  report(stage.equations, stage.T_map_sensor, result);
  result.iterations = iterations_;
  const InformationAnalysis info = analyseInformation(stage.equations, scan_.radius());
  result.hessian_eigenvalues = info.share;
  result.hessian_eigenvectors = info.directions;
  result.degenerate_directions =
      static_cast<int>((info.share.array() < options_.degenerate_threshold).count());
  const double known = static_cast<double>(stage.equations.valid) / std::max(1, stage.equations.points());
  if (known < options_.min_known_ratio) {
    result.reason = TerminationReason::kOutsideMap;
  } else if (!stage.solvable) {
    result.reason = TerminationReason::kDegenerate;
  } else {
    result.reason = stage.converged ? TerminationReason::kConverged : TerminationReason::kMaxIterations;
  }
}

void Registration::Impl::accept(const Hypothesis& best, const Verification& verification,
                                RegistrationResult& result) {
  result.blocked_ratio = best.blocked;
  result.degenerate_directions = verification.degenerate_directions;
  result.explained_ratio = verification.explained_ratio;
  result.least_evidence = verification.open_directions > 0
                              ? std::min(verification.weakest, verification.least_evidence)
                              : verification.least_evidence;
  ConfidenceFeatures features{verification.explained_ratio, result.blocked_ratio, result.unmappedRatio(),
                              result.least_evidence};
  result.confidence = confidence(features);
  features.least_evidence = verification.least_evidence;
  result.fit_confidence = confidence(features);
  if (result.reason != TerminationReason::kConverged && result.reason != TerminationReason::kMaxIterations)
    return;
  result.covariance = posteriorCovariance(best.stage, verification);
  if (result.inlier_ratio < options_.min_inlier_ratio) {
    result.reason = TerminationReason::kLowScore;
  } else if (verification.open_directions > 0) {
    result.reason = TerminationReason::kDegenerate;
  } else if (result.confidence < options_.min_confidence) {
    result.reason = TerminationReason::kUnsure;
  } else {
    result.success = true;
  }
}

Matrix6d Registration::Impl::measuredCovariance(const StageResult& stage) const {
  const Matrix6d about_centroid =
      sandwichCovariance(*field_, scan_, stage.T_map_sensor, stage.equations, model(scales_.last),
                         std::max(scan_.radius() / kCovarianceClusters, scales_.voxel),
                         options_.degenerate_threshold, kUnmeasured);
  // Twists about the sensor's position: its translation also moves by the rotation times the lever arm.
  const Matrix6d shift = leverArmJacobian(stage.T_map_sensor.linear() * scan_.centroid());
  return shift * about_centroid * shift.transpose();
}

Matrix6d Registration::Impl::posteriorCovariance(const StageResult& stage,
                                                 const Verification& verification) const {
  Matrix6d measured = measuredCovariance(stage);
  const InformationAnalysis info = analyseInformation(stage.equations, scan_.radius());
  const Matrix6d shift = leverArmJacobian(stage.T_map_sensor.linear() * scan_.centroid());
  for (std::size_t d = 0; d < 6; ++d) {
    if (!verification.without_evidence[d] && !verification.without_information[d]) continue;
    Vector6d along = info.directions.col(static_cast<Eigen::Index>(d));
    along.head<3>() /= std::max(scan_.radius(), 1e-3);
    along = shift * along;
    const double sigma = verification.without_information[d] ? kUnmeasured : unnoticedSigma();
    measured += sigma * sigma * along * along.transpose();
  }
  const Matrix6d posterior = (measured.inverse() + prior_.information).inverse();
  const FrameAgreement& agreement = field_->agreement();
  if (!agreement.known()) return posterior;
  const Eigen::Isometry3d T_map_sensor = inMapFrame(field_->geometry(), stage.T_map_sensor);
  const Viewpoint viewpoint{T_map_sensor.translation(), T_map_sensor.linear() * scan_.view()};
  Matrix6d covariance =
      withMapErrors(agreement, measured, posterior, stage.T_map_sensor.linear() * scan_.centroid(),
                    varianceRatio(agreement, viewpoint));
  // Frames that were fused do not show what the grid does to all of them alike.
  const double grid_shift = kGridShift * scales_.voxel;
  covariance.diagonal().tail<3>().array() += grid_shift * grid_shift;
  return covariance;
}

}  // namespace ttsdf
