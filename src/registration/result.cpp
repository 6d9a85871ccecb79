#include "result.h"

#include <algorithm>
#include <cmath>

namespace ttsdf {

double score(const NormalEquations& e) {
  return (e.score + kUnknownScore * e.unknown + e.outside + e.behind) / std::max(1, e.points());
}

void report(const NormalEquations& e, const Eigen::Isometry3d& T_map_sensor, RegistrationResult& result) {
  const double points = std::max(1, e.points());
  result.T_map_sensor = T_map_sensor;
  result.rms_residual = std::sqrt(e.inlier_squares / std::max(1, e.inliers));
  result.inlier_ratio = static_cast<double>(e.inliers) / std::max(1, e.valid);
  result.outside_ratio = e.outside / points;
  result.unknown_ratio = e.unknown / points;
  result.behind_ratio = e.behind / points;
  result.score = score(e);
}

}  // namespace ttsdf
