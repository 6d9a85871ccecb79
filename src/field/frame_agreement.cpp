#include "ttsdf_localization/field/frame_agreement.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <stdexcept>
#include <string>

#include "ttsdf_localization/geometry/pose_perturbation.h"

namespace ttsdf {

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
}

Matrix6d withMapErrors(const FrameAgreement& a, const Matrix6d& scan, const Matrix6d& posterior,
                       const Eigen::Vector3d& lever) {
  if (!a.known()) return posterior;
  const Matrix6d share = scan.ldlt().solve(posterior).transpose();  // posterior scan^-1
  Matrix6d result = posterior + (a.widening * a.widening - 1.0) * share * posterior;
  result.diagonal().head<3>().array() += a.turn_sensor * a.turn_sensor;
  result.diagonal().tail<3>().array() += a.shift * a.shift;
  // A turn w about what is seen moves the sensor by -w x lever = hat(lever) w.
  const Eigen::Matrix<double, 6, 3> J = leverArmJacobian(lever).leftCols<3>();
  result += a.turn_scene * a.turn_scene * J * J.transpose();
  return 0.5 * (result + result.transpose());
}

}  // namespace ttsdf
