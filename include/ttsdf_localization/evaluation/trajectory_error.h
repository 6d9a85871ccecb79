#pragma once
// Trajectories in the TUM format (`stamp tx ty tz qx qy qz qw` per line, '#' comments) and their errors
// (Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", 2012).

#include <Eigen/Geometry>
#include <string>
#include <utility>
#include <vector>

namespace ttsdf {

struct TimedPose {
  double stamp = 0.0;  ///< [s]
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
};

using PoseSequence = std::vector<TimedPose>;  ///< rising stamps

/// Throws std::runtime_error naming file and line; lines may come in any order.
PoseSequence readTrajectory(const std::string& path);
void writeTrajectory(const std::string& path, const PoseSequence& trajectory);

/// Pairs (index of estimate, index of truth) whose stamps differ by `max_difference` [s] at most: every pose
/// of the estimate with its nearest pose of the truth, none of which is used twice.
std::vector<std::pair<std::size_t, std::size_t>> associate(const PoseSequence& estimate,
                                                           const PoseSequence& truth, double max_difference);

struct ErrorStatistics {
  double rmse = 0.0, mean = 0.0, median = 0.0, max = 0.0;
};

struct TrajectoryError {
  std::size_t pairs = 0;
  ErrorStatistics translation;                                         ///< [m]
  ErrorStatistics rotation;                                            ///< [rad]
  Eigen::Isometry3d T_truth_estimate = Eigen::Isometry3d::Identity();  ///< the alignment that was applied
};

struct AssociationOptions {
  double max_difference = 0.02;  ///< [s]
  /// Moves the estimate onto the truth first (Umeyama, no scale). Localization in a map needs none: the frame
  /// is common, and an offset is an error like any other.
  bool align = false;
};

/// Absolute trajectory error: pose by pose. Throws std::invalid_argument if no pose pairs up (3 for
/// alignment).
TrajectoryError absoluteTrajectoryError(const PoseSequence& estimate, const PoseSequence& truth,
                                        const AssociationOptions& options = {});

/// Relative pose error: of the motion over `delta` pairs. Throws std::invalid_argument if fewer than delta +
/// 1 pair up.
TrajectoryError relativePoseError(const PoseSequence& estimate, const PoseSequence& truth, std::size_t delta,
                                  const AssociationOptions& options = {});

}  // namespace ttsdf
