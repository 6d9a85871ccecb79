#include "ttsdf_localization/evaluation/sweep.h"

#include <Eigen/Cholesky>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <random>
#include <stdexcept>

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

namespace {

// A method that answers with NaN has failed as badly as can be, and must not spoil the statistics.
double infiniteIfNan(double error) {
  return std::isnan(error) ? std::numeric_limits<double>::infinity() : error;
}

double mahalanobisSquared(const Eigen::Isometry3d& truth, const Estimate& estimate) {
  if (!estimate.covariance) return std::numeric_limits<double>::quiet_NaN();
  Vector6d xi;
  xi << logSo3(truth.linear() * estimate.T_map_sensor.linear().transpose()),
      truth.translation() - estimate.T_map_sensor.translation();
  const Eigen::LDLT<Matrix6d> factor(*estimate.covariance);
  const double distance = xi.dot(factor.solve(xi));
  // A covariance that is not positive definite says that nothing can be wrong: as inconsistent as can be.
  return factor.isPositive() && distance >= 0.0 ? distance : std::numeric_limits<double>::infinity();
}

struct Timed {
  Estimate estimate;
  double milliseconds = 0.0, cpu_milliseconds = 0.0;
};

Timed timed(Method& method, const ScanPoints& points, const Eigen::Isometry3d& T_map_prior,
            const std::optional<Eigen::Vector3d>& gravity) {
  const auto wall = std::chrono::steady_clock::now();
  const std::clock_t cpu = std::clock();
  Timed result{method.estimate(points, T_map_prior, gravity), 0.0, 0.0};
  result.cpu_milliseconds = 1e3 * static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
  result.milliseconds =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - wall).count();
  return result;
}

Timed timedMedian(Method& method, const ScanPoints& points, const Eigen::Isometry3d& T_map_prior,
                  const std::optional<Eigen::Vector3d>& gravity, int repeat) {
  std::vector<double> wall, cpu;
  Timed result;
  for (int n = 0; n < repeat; ++n) {
    result = timed(method, points, T_map_prior, gravity);
    wall.push_back(result.milliseconds);
    cpu.push_back(result.cpu_milliseconds);
  }
  result.milliseconds = quantile(wall, 0.5);
  result.cpu_milliseconds = quantile(cpu, 0.5);
  return result;
}

// The true down direction in the sensor frame, tilted as an IMU's would be; the same for every method.
Eigen::Vector3d gravityHint(const SweepRun& run, const EvaluationScan& scan, int seed) {
  std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(scan.index),
                         0x67726176u};
  std::mt19937 random(sequence);
  const auto gaussian = [&random] {  // Box-Muller: the same numbers with every standard library
    const double u1 = (static_cast<double>(random()) + 1.0) / 4294967297.0;
    const double u2 = static_cast<double>(random()) / 4294967296.0;
    return std::sqrt(-2.0 * std::log(u1)) * std::cos(6.283185307179586 * u2);
  };
  const Eigen::Vector3d down = scan.T_map_sensor.linear().transpose() * run.map_down->normalized();
  const double a = gaussian(), b = gaussian();
  return expSo3(run.gravity_sigma * Eigen::Vector3d(a, b, 0.0)) * down;
}

}  // namespace

void runSweep(const SweepRun& run, Method& method, const std::vector<EvaluationScan>& scans,
              const SweepPlan& plan, SweepLog& log, const std::function<bool(double)>& progress) {
  if (run.repeat < 1) {
    throw std::invalid_argument("sweep: got repeat " + std::to_string(run.repeat) + ", wanted at least 1");
  }
  std::size_t scans_done = 0;
  for (const auto& scan : scans) {
    std::optional<Eigen::Vector3d> gravity;
    if (run.map_down) gravity = gravityHint(run, scan, plan.seed);
    for (const auto& perturbation : perturbations(plan, scan.index)) {
      SweepRecord record;
      record.dataset = run.dataset;
      record.method = run.method;
      record.scan = scan.name;
      record.kind = perturbation.kind;
      record.magnitude = perturbation.magnitude;
      record.direction = perturbation.direction;
      if (log.contains(record)) continue;
      const Timed result =
          timedMedian(method, scan.points, perturbation.apply(scan.T_map_sensor), gravity, run.repeat);
      const PoseError error = poseError(scan.T_map_sensor, result.estimate.T_map_sensor);
      record.translation_error = infiniteIfNan(error.translation);
      record.rotation_error = infiniteIfNan(error.rotation);
      record.offset = scan.T_map_sensor.inverse() * result.estimate.T_map_sensor.translation();
      record.mahalanobis_squared = mahalanobisSquared(scan.T_map_sensor, result.estimate);
      record.confidence = result.estimate.confidence;
      record.accepted = result.estimate.accepted;
      record.reason = result.estimate.reason;
      record.iterations = result.estimate.iterations;
      record.milliseconds = result.milliseconds;
      record.cpu_milliseconds = result.cpu_milliseconds;
      log.append(record);
    }
    if (progress && !progress(static_cast<double>(++scans_done) / static_cast<double>(scans.size()))) return;
  }
}

}  // namespace ttsdf
