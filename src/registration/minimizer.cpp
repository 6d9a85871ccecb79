#include "minimizer.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace ttsdf {

namespace {

Vector6d scaling(double radius) {
  Vector6d s = Vector6d::Ones();
  s.head<3>().setConstant(1.0 / std::max(radius, 1e-3));
  return s;
}

bool small(const Vector6d& xi, const StageOptions& options) {
  return xi.head<3>().norm() < options.rotation_epsilon && xi.tail<3>().norm() < options.translation_epsilon;
}

/// Cost per point. Points outside cost the most a point can; those that say nothing the mean of the stage's
/// start, so that moving points into or out of unknown space is neither rewarded nor punished.
struct Objective {
  double unknown_cost;
  explicit Objective(const NormalEquations& start)
      : unknown_cost(start.valid > 0 ? start.cost / start.valid : 1.0) {}
  double operator()(const NormalEquations& e) const {
    return (e.cost + unknown_cost * (e.unknown + e.behind) + e.outside) / std::max(1, e.points());
  }
};

}  // namespace

InformationAnalysis analyseInformation(const NormalEquations& equations, double radius) {
  const Vector6d s = scaling(radius);
  const Matrix6d scaled = s.asDiagonal() * equations.H * s.asDiagonal() / std::max(equations.weight, 1e-12);
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(scaled);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

StageResult gaussNewton(const DistanceField& field, const ScanBuffer& scan, const Eigen::Isometry3d& T_start,
                        const StageOptions& options) {
  StageResult result;
  result.T_map_sensor = T_start;
  while (result.iterations < options.max_iterations) {
    result.equations = linearize(field, scan, options.points, result.T_map_sensor, options.model);
    ++result.iterations;
    const Eigen::LDLT<Matrix6d> solver(result.equations.H);
    const Vector6d xi = solver.solve(-result.equations.g);
    if (solver.info() != Eigen::Success || !xi.allFinite() || !solver.isPositive()) {
      result.solvable = false;
      return result;
    }
    result.T_map_sensor = retract(result.T_map_sensor, scan.centroid(), xi);
    if (small(xi, options)) {
      result.converged = true;
      break;
    }
  }
  result.equations = linearize(field, scan, options.points, result.T_map_sensor, options.model);
  return result;
}

StageResult levenbergMarquardt(const DistanceField& field, const ScanBuffer& scan,
                               const Eigen::Isometry3d& T_start, const StageOptions& options) {
  StageResult result;
  result.T_map_sensor = T_start;
  result.equations = linearize(field, scan, options.points, T_start, options.model);
  result.iterations = 1;
  const Objective objective(result.equations);
  const Vector6d s = scaling(scan.radius());
  double damping = 1e-3, growth = 2.0;
  while (result.iterations < options.max_iterations) {
    if (!(result.equations.weight > 0.0)) {
      result.solvable = false;
      return result;
    }
    const InformationAnalysis info = analyseInformation(result.equations, scan.radius());
    const Vector6d gradient =
        info.directions.transpose() * (s.asDiagonal() * result.equations.g) / result.equations.weight;
    Vector6d step = Vector6d::Zero();
    double predicted = 0.0;
    for (int d = 0; d < 6; ++d) {
      if (info.share[d] < options.weak_threshold) continue;
      const double curvature = std::max(info.share[d], 0.0) + damping;
      step[d] = -gradient[d] / curvature;
      predicted += 0.5 * step[d] * (damping * step[d] - gradient[d]);
    }
    const Vector6d xi = s.asDiagonal() * (info.directions * step);
    if (!xi.allFinite() || predicted <= 0.0) {
      result.solvable = xi.allFinite();
      result.converged = result.solvable;
      return result;
    }
    const Eigen::Isometry3d T_trial = retract(result.T_map_sensor, scan.centroid(), xi);
    const NormalEquations trial = linearize(field, scan, options.points, T_trial, options.model);
    ++result.iterations;
    const double before = objective(result.equations), after = objective(trial);
    const bool tiny = small(xi, options);
    if (after < before) {
      result.T_map_sensor = T_trial;
      result.equations = trial;
      damping = std::max(damping * 0.3, 1e-7);
      growth = 2.0;
      // A trilinear field has kinks at cell borders: stop on the cost as well, not on a tiny step alone.
      if (tiny || before - after < options.cost_epsilon * before) {
        result.converged = true;
        return result;
      }
    } else {
      if (tiny) {
        result.converged = true;
        return result;
      }
      damping *= growth;
      growth *= 2.0;
    }
  }
  return result;
}

}  // namespace ttsdf
