#include "ttsdf_localization/field/frame_agreement.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace ttsdf {

void check(const FrameAgreement& a) {
  const auto refuse = [](const char* what, double got) {
    throw std::invalid_argument(std::string("frame agreement: got ") + what + " " + std::to_string(got) +
                                ", wanted a finite number >= 0");
  };
  for (const int count : {a.compared, a.contradicting, a.without_overlap}) {
    if (count < 0) refuse("a number of frames of", count);
  }
  for (const double size : {a.position_median, a.position_90, a.rotation_median, a.rotation_90, a.shift,
                            a.turn_sensor, a.turn_scene}) {
    if (!(std::isfinite(size) && size >= 0.0)) refuse("a size of", size);
  }
}

Matrix6d mapCovariance(const FrameAgreement& a, const Eigen::Vector3d& lever) {
  Matrix6d covariance = Matrix6d::Zero();
  if (!a.known()) return covariance;
  covariance.diagonal().head<3>().setConstant(a.turn_scene * a.turn_scene);
  covariance.diagonal().tail<3>().setConstant(a.shift * a.shift);
  // A turn w about the sensor moves what it sees by w x lever = -hat(lever) w.
  Eigen::Matrix<double, 6, 3> J;
  J << Eigen::Matrix3d::Identity(), -hat(lever);
  return covariance + a.turn_sensor * a.turn_sensor * J * J.transpose();
}

}  // namespace ttsdf
