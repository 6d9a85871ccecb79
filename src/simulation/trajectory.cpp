#include "ttsdf_localization/simulation/trajectory.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "scenes/headings.h"

namespace ttsdf {

namespace {

constexpr int kStepsPerSegment = 60;
constexpr double kSwayShare = 0.2;  ///< of both speed limits that is kept for the sway

/// Angular frequencies of the sway [rad/s], in no simple ratio to each other.
Eigen::Array3d positionRates() { return 2.0 * kPi / Eigen::Array3d(7.9, 9.7, 3.7); }
Eigen::Array3d angleRates() { return 2.0 * kPi / Eigen::Array3d(7.4, 5.3, 11.3); }  // roll, pitch, yaw

Eigen::Matrix3d rotationOf(double yaw, double pitch) {
  // Pitch is positive upwards, a turn about y (left) downwards.
  return (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(-pitch, Eigen::Vector3d::UnitY()))
      .toRotationMatrix();
}

/// Largest value in a window of +-`reach` entries, then their mean over the same window: smooth, and never
/// below the input. Indices wrap on a closed path and stop at the ends of an open one.
std::vector<double> smoothEnvelope(const std::vector<double>& values, int reach, bool closed) {
  const int n = static_cast<int>(values.size());
  const auto at = [&](const std::vector<double>& v, int i) {
    return v[static_cast<std::size_t>(closed ? ((i % n) + n) % n : std::clamp(i, 0, n - 1))];
  };
  std::vector<double> highest(values.size()), mean(values.size());
  for (int i = 0; i < n; ++i) {
    double& best = highest[static_cast<std::size_t>(i)];
    for (int k = -reach; k <= reach; ++k) best = std::max(best, at(values, i + k));
  }
  for (int i = 0; i < n; ++i) {
    double& sum = mean[static_cast<std::size_t>(i)];
    for (int k = -reach; k <= reach; ++k) sum += at(highest, i + k) / (2 * reach + 1);
  }
  return mean;
}

}  // namespace

const OptionTable<TrajectoryOptions>& trajectoryOptionTable() {
  using O = TrajectoryOptions;
  static const OptionTable<O> kTable =
      OptionTable<O>()
          .add("speed", &O::speed, 0.01, 20.0, "m/s", "Largest speed of the camera.")
          .add("turn_rate", &O::turn_rate, 0.01, 20.0, "rad/s", "Largest angular speed of the camera.")
          .add("sway_position", &O::sway_position, 0.0, 0.2, "m",
               "Amplitude of the slow sway of the position.")
          .add("sway_angle", &O::sway_angle, 0.0, 0.5, "rad", "Amplitude of the slow sway of the angles.");
  return kTable;
}

Trajectory::Trajectory(const std::vector<Waypoint>& waypoints, bool closed, const TrajectoryOptions& options)
    : closed_(closed), sway_position_(options.sway_position), sway_angle_(options.sway_angle) {
  trajectoryOptionTable().validate(options);
  const std::size_t wanted = closed ? 3 : 2;
  if (waypoints.size() < wanted) {
    std::ostringstream message;
    message << "trajectory: got " << waypoints.size() << " waypoints, wanted at least " << wanted;
    throw std::invalid_argument(message.str());
  }
  layKnots(waypoints);
  layTimes(options);
}

void Trajectory::layKnots(const std::vector<Waypoint>& waypoints) {
  std::vector<Knot> path;
  for (const Waypoint& w : waypoints) {
    const Eigen::Vector3d look = w.look_at - w.position;
    if (!(look.norm() > 1e-6) || !w.position.allFinite()) {
      throw std::invalid_argument(
          "trajectory: got a waypoint that looks at itself, wanted another point to look at");
    }
    double yaw = std::atan2(look.y(), look.x());
    // The short way round from the waypoint before.
    if (!path.empty()) yaw += 2.0 * kPi * std::round((path.back()[3] - yaw) / (2.0 * kPi));
    Knot knot;
    knot << w.position, yaw, std::atan2(look.z(), look.head<2>().norm());
    path.push_back(knot);
  }
  Knot turns = Knot::Zero();  // whole turns of yaw in one lap
  if (closed_) turns[3] = 2.0 * kPi * std::round((path.back()[3] - path.front()[3]) / (2.0 * kPi));
  knots_ = path;
  if (closed_) {
    knots_.insert(knots_.begin(), path.back() - turns);
    knots_.push_back(path[0] + turns);
    knots_.push_back(path[1] + turns);
  } else {
    knots_.insert(knots_.begin(), 2.0 * path[0] - path[1]);
    knots_.push_back(2.0 * path.back() - path[path.size() - 2]);
  }
  parameters_.push_back(0.0);
  for (std::size_t i = 1; i < knots_.size(); ++i) {
    const double distance = (knots_[i] - knots_[i - 1]).head<3>().norm();
    if (!(distance > 1e-6))
      throw std::invalid_argument("trajectory: got two waypoints in a row at the same place");
    parameters_.push_back(parameters_.back() + std::sqrt(distance));
  }
}

/// Barry and Goldman's pyramid on the four knots around a segment.
Trajectory::Knot Trajectory::spline(double u) const {
  const auto after = std::upper_bound(parameters_.begin() + 2, parameters_.end() - 2, u);
  const double* t = &*after - 2;
  const Knot* p = &knots_[static_cast<std::size_t>(after - parameters_.begin()) - 2];
  const auto mix = [u](const Knot& a, const Knot& b, double ta, double tb) -> Knot {
    return a + (b - a) * ((u - ta) / (tb - ta));
  };
  const Knot a0 = mix(p[0], p[1], t[0], t[1]), a1 = mix(p[1], p[2], t[1], t[2]),
             a2 = mix(p[2], p[3], t[2], t[3]);
  const Knot b0 = mix(a0, a1, t[0], t[2]), b1 = mix(a1, a2, t[1], t[3]);
  return mix(b0, b1, t[1], t[2]);
}

void Trajectory::layTimes(const TrajectoryOptions& options) {
  const int steps = kStepsPerSegment * (static_cast<int>(knots_.size()) - 3);
  parameter_step_ = (parameters_[parameters_.size() - 2] - parameters_[1]) / steps;
  std::vector<double> needed(static_cast<std::size_t>(steps));
  Knot before = spline(parameters_[1]);
  for (int i = 0; i < steps; ++i) {
    const Knot after = spline(parameters_[1] + (i + 1) * parameter_step_);
    const double moved = (after - before).head<3>().norm();
    const Eigen::AngleAxisd turn(rotationOf(before[3], before[4]).transpose() *
                                 rotationOf(after[3], after[4]));
    needed[static_cast<std::size_t>(i)] =
        std::max(moved / options.speed, turn.angle() / options.turn_rate) / (1.0 - kSwayShare);
    length_ += moved;
    before = after;
  }
  times_ = {0.0};
  for (const double step : smoothEnvelope(needed, kStepsPerSegment / 2, closed_)) {
    times_.push_back(times_.back() + step);
  }
  sway_position_ = std::min(sway_position_, kSwayShare * options.speed / positionRates().matrix().norm());
  sway_angle_ = std::min(sway_angle_, kSwayShare * options.turn_rate / angleRates().sum());
}

Eigen::Isometry3d Trajectory::pose(double time) const {
  double t = std::fmod(time, closed_ ? duration() : 2.0 * duration());
  if (t < 0.0) t += closed_ ? duration() : 2.0 * duration();
  if (t > duration()) t = 2.0 * duration() - t;
  const auto after = std::upper_bound(times_.begin() + 1, times_.end() - 1, t);
  const double begin = *(after - 1), end = *after;
  const double step = static_cast<double>(after - times_.begin() - 1) + (t - begin) / (end - begin);
  const Knot knot = spline(parameters_[1] + step * parameter_step_);
  const Eigen::Array3d angles = sway_angle_ * (angleRates() * time).sin();
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = knot.head<3>() + (sway_position_ * (positionRates() * time).sin()).matrix();
  T.linear() = rotationOf(knot[3] + angles[2], knot[4] + angles[1]) *
               Eigen::AngleAxisd(angles[0], Eigen::Vector3d::UnitX()).toRotationMatrix();
  return T;
}

std::vector<StampedPose> Trajectory::sample(double rate) const {
  if (!(rate > 0.0)) throw std::invalid_argument("trajectory: got a sampling rate that is not positive");
  std::vector<StampedPose> poses;
  const auto count = static_cast<std::size_t>(std::floor(duration() * rate)) + 1;
  poses.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double time = static_cast<double>(i) / rate;
    poses.push_back({time, pose(time)});
  }
  return poses;
}

}  // namespace ttsdf
