// Poses that lie far from all others.

#include <algorithm>
#include <utility>
#include <vector>

#include "ttsdf_localization/frames/frame_check.h"
#include "ttsdf_localization/geometry/median.h"

namespace ttsdf {

std::vector<std::pair<std::size_t, double>> strayPoses(const std::vector<Eigen::Isometry3d>& poses) {
  constexpr double kFar = 50.0, kTimes = 20.0;  // [m], and in typical distances
  std::vector<std::pair<std::size_t, double>> stray;
  if (poses.size() < 3) return stray;
  Eigen::Vector3d median;
  std::vector<double> values(poses.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t n = 0; n < poses.size(); ++n) values[n] = poses[n].translation()[axis];
    median[axis] = upperMedian(values);
  }
  for (std::size_t n = 0; n < poses.size(); ++n) values[n] = (poses[n].translation() - median).norm();
  const std::vector<double> distances = values;
  const double typical = upperMedian(values);
  for (std::size_t n = 0; n < poses.size(); ++n) {
    if (!(distances[n] <= kFar + kTimes * typical)) stray.emplace_back(n, distances[n]);
  }
  return stray;
}

}  // namespace ttsdf
