#pragma once
// The paper's sweep (section VI): every observation starts from its true pose, moved by a pure translation or
// turned by a pure rotation about the sensor, in directions sampled uniformly.

#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace ttsdf {

enum class PerturbationKind { kTranslation, kRotation };

const char* name(PerturbationKind kind);                        ///< "translation" | "rotation"
PerturbationKind perturbationKindFromName(const std::string&);  ///< throws std::invalid_argument

struct Perturbation {
  PerturbationKind kind = PerturbationKind::kTranslation;
  double magnitude = 0.0;  ///< [m] or [rad]
  int direction = 0;       ///< number of the direction, from 0
  Eigen::Isometry3d T_sensor_prior = Eigen::Isometry3d::Identity();

  /// T_map_prior = T_map_sensor * T_sensor_prior: poseError(truth, prior) is exactly the magnitude.
  Eigen::Isometry3d apply(const Eigen::Isometry3d& T_map_sensor) const {
    return T_map_sensor * T_sensor_prior;
  }
};

struct SweepPlan {
  std::vector<double> translations{0.05, 0.1, 0.2, 0.5, 1.0};  ///< [m]
  std::vector<double> rotations{0.01, 0.02, 0.05, 0.1, 0.25};  ///< [rad]
  int directions = 5;
  int seed = 1;
};

/// Every perturbation of one scan. The directions depend on seed, scan, kind and magnitude only: leaving a
/// magnitude out or evaluating scans in another order changes none of the others. Throws
/// std::invalid_argument for magnitudes or counts below 0.
std::vector<Perturbation> perturbations(const SweepPlan& plan, int scan_index);

}  // namespace ttsdf
