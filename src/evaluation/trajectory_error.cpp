#include "ttsdf_localization/evaluation/trajectory_error.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <set>
#include <sstream>
#include <stdexcept>

#include "ttsdf_localization/evaluation/statistics.h"
#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

namespace {

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

TimedPose parseLine(const std::string& line) {
  std::istringstream numbers(line);
  TimedPose pose;
  Eigen::Vector3d t;
  double qx = 0.0, qy = 0.0, qz = 0.0, qw = 0.0;
  std::string rest;
  if (!(numbers >> pose.stamp >> t.x() >> t.y() >> t.z() >> qx >> qy >> qz >> qw) || numbers >> rest) {
    throw std::runtime_error("got '" + line + "', wanted 8 numbers: stamp tx ty tz qx qy qz qw");
  }
  const Eigen::Quaterniond q(qw, qx, qy, qz);
  if (!(std::abs(q.norm() - 1.0) < 0.01)) {
    throw std::runtime_error("got a quaternion of length " + std::to_string(q.norm()) + ", wanted 1");
  }
  pose.T_map_sensor = Eigen::Translation3d(t) * q.normalized();
  return pose;
}

ErrorStatistics statistics(const std::vector<double>& errors) {
  ErrorStatistics result;
  for (const double error : errors) {
    result.rmse += error * error;
    result.mean += error;
    result.max = std::max(result.max, error);
  }
  const auto count = static_cast<double>(errors.size());
  result.rmse = std::sqrt(result.rmse / count);
  result.mean /= count;
  result.median = quantile(errors, 0.5);
  return result;
}

Pairs associateOrThrow(const PoseSequence& estimate, const PoseSequence& truth, double max_difference,
                       std::size_t wanted) {
  Pairs pairs = associate(estimate, truth, max_difference);
  if (pairs.size() < wanted) {
    throw std::invalid_argument("trajectories: got " + std::to_string(pairs.size()) +
                                " pairs of poses within " + std::to_string(max_difference) +
                                " s, wanted at least " + std::to_string(wanted));
  }
  return pairs;
}

Eigen::Isometry3d alignment(const PoseSequence& estimate, const PoseSequence& truth, const Pairs& pairs) {
  const auto count = static_cast<Eigen::Index>(pairs.size());
  Eigen::Matrix3Xd from(3, count), to(3, count);
  for (Eigen::Index n = 0; n < count; ++n) {
    const auto& pair = pairs[static_cast<std::size_t>(n)];
    from.col(n) = estimate[pair.first].T_map_sensor.translation();
    to.col(n) = truth[pair.second].T_map_sensor.translation();
  }
  Eigen::Isometry3d T;
  T.matrix() = Eigen::umeyama(from, to, false);
  return T;
}

}  // namespace

PoseSequence readTrajectory(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error("trajectory '" + path + "': cannot read");
  PoseSequence trajectory;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    const auto first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    try {
      trajectory.push_back(parseLine(line));
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("trajectory '" + path + "', line " + std::to_string(number) + ": " +
                               error.what());
    }
  }
  const auto earlier = [](const TimedPose& a, const TimedPose& b) { return a.stamp < b.stamp; };
  std::stable_sort(trajectory.begin(), trajectory.end(), earlier);
  return trajectory;
}

void writeTrajectory(const std::string& path, const PoseSequence& trajectory) {
  std::ofstream out(path);
  out << "# stamp tx ty tz qx qy qz qw\n" << std::fixed << std::setprecision(9);
  for (const auto& pose : trajectory) {
    const Eigen::Vector3d t = pose.T_map_sensor.translation();
    const Eigen::Quaterniond q(pose.T_map_sensor.linear());
    out << pose.stamp << ' ' << t.x() << ' ' << t.y() << ' ' << t.z() << ' ' << q.x() << ' ' << q.y() << ' '
        << q.z() << ' ' << q.w() << '\n';
  }
  if (!out.flush()) throw std::runtime_error("trajectory '" + path + "': cannot write");
}

Pairs associate(const PoseSequence& estimate, const PoseSequence& truth, double max_difference) {
  struct Candidate {
    double difference;
    std::size_t estimate, truth;
  };
  std::vector<Candidate> candidates;
  for (std::size_t e = 0; e < estimate.size(); ++e) {
    const double earliest = estimate[e].stamp - max_difference;
    auto t = std::lower_bound(truth.begin(), truth.end(), earliest,
                              [](const TimedPose& pose, double stamp) { return pose.stamp < stamp; });
    for (; t != truth.end() && t->stamp <= estimate[e].stamp + max_difference; ++t) {
      candidates.push_back(
          {std::abs(t->stamp - estimate[e].stamp), e, static_cast<std::size_t>(t - truth.begin())});
    }
  }
  // Nearest first: a pose goes to the partner that fits it best.
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.difference < b.difference; });
  std::set<std::size_t> used_estimates, used_truths;
  Pairs pairs;
  for (const auto& candidate : candidates) {
    if (used_estimates.count(candidate.estimate) || used_truths.count(candidate.truth)) continue;
    used_estimates.insert(candidate.estimate);
    used_truths.insert(candidate.truth);
    pairs.emplace_back(candidate.estimate, candidate.truth);
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

TrajectoryError absoluteTrajectoryError(const PoseSequence& estimate, const PoseSequence& truth,
                                        const AssociationOptions& options) {
  const Pairs pairs = associateOrThrow(estimate, truth, options.max_difference, options.align ? 3 : 1);
  TrajectoryError result;
  result.pairs = pairs.size();
  if (options.align) result.T_truth_estimate = alignment(estimate, truth, pairs);
  std::vector<double> translation, rotation;
  for (const auto& [e, t] : pairs) {
    const PoseError error =
        poseError(truth[t].T_map_sensor, result.T_truth_estimate * estimate[e].T_map_sensor);
    translation.push_back(error.translation);
    rotation.push_back(error.rotation);
  }
  result.translation = statistics(translation);
  result.rotation = statistics(rotation);
  return result;
}

TrajectoryError relativePoseError(const PoseSequence& estimate, const PoseSequence& truth, std::size_t delta,
                                  const AssociationOptions& options) {
  if (delta == 0) throw std::invalid_argument("relative pose error: got delta 0, wanted at least 1");
  const Pairs pairs = associateOrThrow(estimate, truth, options.max_difference, delta + 1);
  TrajectoryError result;
  result.pairs = pairs.size() - delta;
  std::vector<double> translation, rotation;
  for (std::size_t n = 0; n + delta < pairs.size(); ++n) {
    const auto motion = [](const PoseSequence& poses, std::size_t from, std::size_t to) -> Eigen::Isometry3d {
      return poses[from].T_map_sensor.inverse() * poses[to].T_map_sensor;
    };
    const PoseError error = poseError(motion(truth, pairs[n].second, pairs[n + delta].second),
                                      motion(estimate, pairs[n].first, pairs[n + delta].first));
    translation.push_back(error.translation);
    rotation.push_back(error.rotation);
  }
  result.translation = statistics(translation);
  result.rotation = statistics(rotation);
  return result;
}

}  // namespace ttsdf
