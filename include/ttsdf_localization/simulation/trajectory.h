#pragma once
// A smooth path of a camera through waypoints, with bounded linear and angular speed. The moving frame is a
// body frame as in REP-103: x forward, y left, z up; but for its sway it never rolls.

#include <Eigen/Geometry>
#include <vector>

#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

struct Waypoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of the body [m]
  Eigen::Vector3d look_at = Eigen::Vector3d::UnitX();  ///< point it faces [m]
};

struct TrajectoryOptions {
  double speed = 0.5;           ///< largest speed [m/s]
  double turn_rate = 0.7;       ///< largest angular speed [rad/s]
  double sway_position = 0.03;  ///< amplitude of the slow sway that makes every lap a little different [m]
  double sway_angle = 0.03;     ///< the same for the angles [rad]
};
const OptionTable<TrajectoryOptions>& trajectoryOptionTable();

struct StampedPose {
  double time = 0.0;  ///< [s]
  Eigen::Isometry3d T_map_base = Eigen::Isometry3d::Identity();
};

class Trajectory {
 public:
  /// Centripetal Catmull-Rom spline through the waypoints; a closed one returns to the first. Throws
  /// std::invalid_argument for fewer than two (closed: three) waypoints, one that looks at itself, two in a
  /// row at the same place, or bad options.
  Trajectory(const std::vector<Waypoint>& waypoints, bool closed, const TrajectoryOptions& options = {});

  double duration() const { return times_.back(); }  ///< of one lap [s]
  double length() const { return length_; }          ///< of one lap [m]
  bool closed() const { return closed_; }

  /// Pose at a time [s]; a closed path goes on with the next lap, an open one turns back at its ends.
  Eigen::Isometry3d pose(double time) const;
  /// One lap at a constant rate [Hz].
  std::vector<StampedPose> sample(double rate) const;

 private:
  using Knot = Eigen::Matrix<double, 5, 1>;  // x, y, z [m], yaw, pitch [rad]

  void layKnots(const std::vector<Waypoint>& waypoints);
  void layTimes(const TrajectoryOptions& options);
  Knot spline(double u) const;

  bool closed_;
  double sway_position_, sway_angle_, length_ = 0.0;
  double parameter_step_ = 0.0;
  std::vector<Knot> knots_;         // one more at either end than the path has
  std::vector<double> parameters_;  // of the knots: centripetal
  std::vector<double> times_;       // at equal steps of the parameter
};

}  // namespace ttsdf
