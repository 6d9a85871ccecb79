#include "ttsdf_localization/field/frame_agreement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "ttsdf_localization/geometry/pose_perturbation.h"

namespace ttsdf {

Viewpoint viewpointOf(const Eigen::Matrix3Xf& points, const Eigen::Isometry3d& T_map_sensor) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    const Eigen::Vector3d p = points.col(n).cast<double>();
    const double range = p.norm();
    if (!(range > 0.0) || !std::isfinite(range)) continue;
    sum += p / range;
    ++count;
  }
  return {T_map_sensor.translation(), T_map_sensor.linear() * sum / std::max(count, 1)};
}

double varianceRatio(const FrameAgreement& agreement, const Viewpoint& viewpoint) {
  double weights = 1.0, sum = 1.0;
  for (const ViewpointAgreement& known : agreement.viewpoints) {
    const double moved =
        (known.viewpoint.position - viewpoint.position).norm() / agreement.viewpoint_distance;
    const double turned = (known.viewpoint.view - viewpoint.view).norm() / kViewpointAngle;
    const double weight = known.frames * std::exp(-0.5 * (moved * moved + turned * turned));
    weights += weight, sum += weight * known.ratio;
  }
  return sum / weights;
}

void check(const FrameAgreement& a) {
  const auto refuse = [](const char* what, double got) {
    throw std::invalid_argument(std::string("frame agreement: got ") + what + " " + std::to_string(got) +
                                ", wanted a finite number >= 0");
  };
  for (const int count : {a.compared, a.contradicting, a.without_overlap}) {
    if (count < 0) refuse("a number of frames of", count);
  }
  if (!(std::isfinite(a.widening) && a.widening >= 1.0)) {
    throw std::invalid_argument("frame agreement: got a widening of " + std::to_string(a.widening) +
                                ", wanted at least 1");
  }
  for (const double size : {a.position_median, a.position_90, a.rotation_median, a.rotation_90, a.shift,
                            a.turn_sensor, a.turn_scene}) {
    if (!(std::isfinite(size) && size >= 0.0)) refuse("a size of", size);
  }
  if (a.viewpoints.empty()) return;
  if (!(std::isfinite(a.viewpoint_distance) && a.viewpoint_distance > 0.0)) {
    throw std::invalid_argument("frame agreement: got a distance of viewpoints of " +
                                std::to_string(a.viewpoint_distance) + " m, wanted a positive one");
  }
  for (const ViewpointAgreement& v : a.viewpoints) {
    if (v.frames < 1 || !(std::isfinite(v.ratio) && v.ratio > 0.0) || !v.viewpoint.position.allFinite() ||
        !v.viewpoint.view.allFinite()) {
      throw std::invalid_argument("frame agreement: got a viewpoint of " + std::to_string(v.frames) +
                                  " frames and ratio " + std::to_string(v.ratio) +
                                  ", wanted at least one frame, a positive ratio and finite numbers");
    }
  }
}

Matrix6d withMapErrors(const FrameAgreement& a, const Matrix6d& scan, const Matrix6d& posterior,
                       const Eigen::Vector3d& lever, double variance_ratio) {
  if (!a.known()) return posterior;
  const Matrix6d share = scan.ldlt().solve(posterior).transpose();  // posterior scan^-1
  // No viewpoint is so good that a scan would be surer than its own residuals say.
  const double widened = std::max(variance_ratio * a.widening * a.widening, 1.0);
  Matrix6d result = posterior + (widened - 1.0) * share * posterior;
  result.diagonal().head<3>().array() += variance_ratio * a.turn_sensor * a.turn_sensor;
  result.diagonal().tail<3>().array() += variance_ratio * a.shift * a.shift;
  // A turn w about what is seen moves the sensor by -w x lever = hat(lever) w.
  const Eigen::Matrix<double, 6, 3> J = leverArmJacobian(lever).leftCols<3>();
  result += variance_ratio * a.turn_scene * a.turn_scene * J * J.transpose();
  return 0.5 * (result + result.transpose());
}

}  // namespace ttsdf
