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

/// What a point's share of the cost counts against the prior [1 / m^2].
double pointWeight(const NormalEquations& e, double sigma, double independent_points) {
  const double points = std::max(1, e.points());
  return std::min(independent_points, points) / (points * sigma * sigma);
}

/// Negative log likelihood of scan and prior. Points outside cost the most a point can; those that say
/// nothing the mean of the stage's start, so that moving points into or out of unknown space is neither
/// rewarded nor punished.
struct Objective {
  double unknown_cost, data_weight, loss_weight;
  const PosePrior& prior;
  Objective(const NormalEquations& start, const StageOptions& options)
      : unknown_cost(start.valid > 0 ? start.cost / start.valid : 1.0),
        data_weight(pointWeight(start, kernelSigma(options.model.scale), options.independent_points)),
        loss_weight(0.5 * options.model.scale * options.model.scale * data_weight),
        prior(options.prior) {}
  double operator()(const NormalEquations& e, const Eigen::Isometry3d& T) const {
    return loss_weight * (e.cost + unknown_cost * (e.unknown + e.behind) + e.outside) +
           0.5 * prior.squaredDistance(T);
  }
};

/// Normal equations of what counts of the scan, in the scaled space, per unit of robust weight.
struct CountedEquations {
  Matrix6d H;
  Vector6d g;
};
CountedEquations counted(const NormalEquations& e, double radius, double gradient_noise) {
  const InformationAnalysis info = analyseInformation(e, radius);
  Vector6d counts, share;
  for (int d = 0; d < 6; ++d) {
    counts[d] = countedShare(info.share[d], gradient_noise);
    share[d] = counts[d] * std::max(info.share[d], 0.0);
  }
  const Vector6d gradient =
      info.directions.transpose() * (scaling(radius).asDiagonal() * e.g) / std::max(e.weight, 1e-12);
  return {info.directions * share.asDiagonal() * info.directions.transpose(),
          info.directions * counts.cwiseProduct(gradient)};
}

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

double countedShare(double share, double gradient_noise) {
  return std::max(0.0, share - gradient_noise) / std::max(share, 1e-12);
}

double dataWeight(const NormalEquations& equations, double sigma) {
  return pointWeight(equations, sigma, kIndependentPoints) * equations.weight;
}

Eigen::Isometry3d fuseWithPrior(const ScanBuffer& scan, const Eigen::Isometry3d& T_fit,
                                const Matrix6d& directions, const Vector6d& information,
                                const PosePrior& prior) {
  if (prior.information.isZero()) return T_fit;
  const Vector6d s = scaling(scan.radius());
  const Matrix6d data = directions * information.asDiagonal() * directions.transpose();
  Eigen::Isometry3d T = T_fit;
  Vector6d moved = Vector6d::Zero();      // from the fit, scaled
  for (int pass = 0; pass < 3; ++pass) {  // the prior's displacement turns a little with the rotation
    Matrix6d H = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    prior.add(T, scan.centroid(), H, g);
    const Matrix6d A = data + s.asDiagonal() * H * s.asDiagonal();
    const Vector6d step = A.ldlt().solve(-(data * moved + s.asDiagonal() * g));
    if (!step.allFinite()) return T_fit;
    T = retract(T, scan.centroid(), s.asDiagonal() * step);
    moved += step;
  }
  return T;
}

Eigen::Isometry3d fuseWithPrior(const NormalEquations& equations, const ScanBuffer& scan,
                                const Eigen::Isometry3d& T_fit, const PosePrior& prior, double sigma,
                                double gradient_noise) {
  const InformationAnalysis info = analyseInformation(equations, scan.radius());
  Vector6d information;
  for (int d = 0; d < 6; ++d)
    information[d] = dataWeight(equations, sigma) * std::max(0.0, info.share[d] - gradient_noise);
  return fuseWithPrior(scan, T_fit, info.directions, information, prior);
}

StageResult levenbergMarquardt(const DistanceField& field, const ScanBuffer& scan,
                               const Eigen::Isometry3d& T_start, const StageOptions& options) {
  StageResult result;
  result.T_map_sensor = T_start;
  result.equations = linearize(field, scan, options.points, T_start, options.model);
  result.iterations = 1;
  const Objective objective(result.equations, options);
  const Vector6d s = scaling(scan.radius());
  double damping = 1e-3, growth = 2.0;
  while (result.iterations < options.max_iterations) {
    if (!(result.equations.weight > 0.0)) {
      result.solvable = false;
      return result;
    }
    const CountedEquations data = counted(result.equations, scan.radius(), options.gradient_noise);
    const double weight = objective.data_weight * result.equations.weight;
    Matrix6d H = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    options.prior.add(result.T_map_sensor, scan.centroid(), H, g);
    Matrix6d A = weight * data.H + s.asDiagonal() * H * s.asDiagonal();
    const Vector6d b = weight * data.g + s.asDiagonal() * g;
    A.diagonal().array() += damping * weight;
    const Vector6d step = A.ldlt().solve(-b);
    const Vector6d xi = s.asDiagonal() * step;
    const double predicted = -0.5 * b.dot(step);
    if (!xi.allFinite() || predicted <= 0.0) {
      result.solvable = xi.allFinite();
      result.converged = result.solvable;
      return result;
    }
    const Eigen::Isometry3d T_trial = retract(result.T_map_sensor, scan.centroid(), xi);
    const NormalEquations trial = linearize(field, scan, options.points, T_trial, options.model);
    ++result.iterations;
    const double before = objective(result.equations, result.T_map_sensor), after = objective(trial, T_trial);
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
