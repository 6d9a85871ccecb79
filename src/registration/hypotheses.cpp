// How a pose that explains the scan is found: descents from a start, in the far field and in the map.

#include <algorithm>
#include <cmath>

#include "multi_start/descent.h"
#include "multi_start/start_poses.h"
#include "registration_impl.h"
#include "result.h"
#include "verification/ray_check.h"
#include "verification/uncertainty.h"

namespace ttsdf {

namespace {

constexpr int kStepsPerScale = 6;
constexpr double kScalePerRms = 6.0;
constexpr double kScaleFactor = 0.55;
constexpr int kMiddlePoints = 1000;
constexpr int kCoarsePoints = 400;  // of descents in the far field
constexpr int kNearIterations = 5;
constexpr int kMiddleIterations = 8;
constexpr double kMiddleCostEpsilon = 3e-3;
constexpr int kNarrowings = 4;
constexpr double kNarrowing = 0.4;  // of the kernel in one pass, at the most
constexpr int kPartIterations = 6;
constexpr double kKernelSigmas = 5.0;  // kernel scale per spread of the residuals
constexpr int kRestartSteps = 10;
constexpr std::size_t kRestartsRefined = 3;
constexpr int kNearRestarts = 8;
constexpr std::size_t kNearRestartsRefined = 4;
constexpr int kRays = 100;

}  // namespace

ResidualModel Registration::Impl::model(double scale) const {
  ResidualModel m;
  m.scale = scale;
  m.inlier_distance = scales_.tolerance;
  m.score_scale = scales_.score;
  m.check_facing = facing_;
  m.deep_inside = 2.5 * scales_.voxel;
  return m;
}

StageOptions Registration::Impl::stageOptions(double scale, int points, int iterations) const {
  StageOptions stage;
  stage.points = points;
  stage.model = model(scale);
  stage.max_iterations = std::max(2, std::min(iterations, options_.max_iterations));
  stage.rotation_epsilon = options_.rotation_epsilon;
  stage.translation_epsilon = options_.translation_epsilon;
  stage.cost_epsilon = options_.cost_epsilon;
  stage.prior = prior_;
  return stage;
}

Eigen::Isometry3d Registration::Impl::fusedWithPrior(const Eigen::Isometry3d& T) {
  const NormalEquations e =
      linearize(*field_, scan_, scan_.prefix(kMiddlePoints), T, model(scales_.near_second));
  ++iterations_;
  if (!(e.weight > 0.0)) return T;
  return fuseWithPrior(e, scan_, T, prior_, kernelSigma(scales_.near_first), gradientNoise(e, scales_.voxel));
}

Registration::Impl::Hypothesis Registration::Impl::solveHypothesis(const Eigen::Isometry3d& T_start) {
  Hypothesis h;
  const int points = scan_.prefix(kMiddlePoints);
  Eigen::Isometry3d T = T_start;
  const double spread = residualSpread(*field_, scan_, points, T, model(scales_.near_second));
  if (kScalePerSigma * spread > 1.5 * scales_.near_second) {
    StageOptions first = stageOptions(scales_.near_first, points, kNearIterations);
    first.cost_epsilon = kMiddleCostEpsilon;
    const StageResult near = levenbergMarquardt(*field_, scan_, T, first);
    iterations_ += near.iterations;
    T = near.T_map_sensor;
  }
  StageOptions second = stageOptions(scales_.near_second, points, kMiddleIterations);
  second.cost_epsilon = kMiddleCostEpsilon;
  h.stage = levenbergMarquardt(*field_, scan_, T, second);
  iterations_ += h.stage.iterations;
  evaluateCost(h);
  return h;
}

void Registration::Impl::checkRays(Hypothesis& h) const {
  h.T_blocked = h.stage.T_map_sensor;
  h.blocked = blockedShare(*field_, long_range_.get(), scan_, h.T_blocked, kRays);
}

void Registration::Impl::evaluateCost(Hypothesis& h) const {
  checkRays(h);
  h.cost = kIndependentPoints * (score(h.stage.equations) + h.blocked) +
           0.5 * prior_.squaredDistance(h.stage.T_map_sensor);
}

bool Registration::Impl::contains(const std::vector<Hypothesis>& all, const Eigen::Isometry3d& T) const {
  return std::any_of(all.begin(), all.end(), [&](const Hypothesis& h) {
    const PoseError apart = poseError(T, h.stage.T_map_sensor);
    return apart.translation + apart.rotation * scales_.lever <= scales_.tolerance;
  });
}

void Registration::Impl::addHypothesis(const Hypothesis& other, double margin, std::vector<Hypothesis>& all) {
  all.push_back(other);
  if (other.cost + margin < all.front().cost) std::swap(all.front(), all.back());
}

bool Registration::Impl::replaceIfBetter(const Hypothesis& other, double margin, Hypothesis& best) {
  if (!(other.cost + margin < best.cost)) return false;
  best = other;
  return true;
}

double Registration::Impl::knownSpaceScore(const Hypothesis& h) {
  const NormalEquations& e = h.stage.equations;
  if (e.valid < 0.5 * e.points()) return 2.0;
  return (e.score + e.behind) / std::max(1, e.valid + e.behind) + h.blocked;
}

void Registration::Impl::refine(StageResult& best) {
  prepare(*field_, scan_, scan_.size(), best.T_map_sensor);
  const int part = scan_.prefix(kMiddlePoints);
  const double noise = gradientNoise(best.equations, scales_.voxel);
  double scale = scales_.last;
  const auto solve = [&](int points, int iterations, double cost_epsilon,
                         double independent = kIndependentPoints) {
    StageOptions stage = stageOptions(scale, points, iterations);
    stage.gradient_noise = noise;
    stage.independent_points = independent;
    stage.cost_epsilon = std::max(stage.cost_epsilon, cost_epsilon);
    const StageResult solved = levenbergMarquardt(*field_, scan_, best.T_map_sensor, stage);
    iterations_ += solved.iterations;
    if (solved.solvable) best = solved;
    return solved.solvable;
  };
  if (!solve(part, kPartIterations, kMiddleCostEpsilon)) {
    best.solvable = false;
    return;
  }
  for (int pass = 0; pass < kNarrowings; ++pass) {
    const double spread = residualSpread(*field_, scan_, part, best.T_map_sensor, model(scale));
    const double narrower = std::max({kKernelSigmas * spread, scales_.least, kNarrowing * scale});
    if (narrower > 0.8 * scale) break;
    scale = narrower;
    if (!solve(part, kPartIterations, kMiddleCostEpsilon)) break;
  }
  solve(scan_.fitted(), options_.max_iterations, 0.0, kIndependentPointsAtLast);
  // What the scan says about the pose is told with the wide kernel, whatever refined it.
  if (scale < scales_.last)
    best.equations = linearize(*field_, scan_, scan_.fitted(), best.T_map_sensor, model(scales_.last));
}

void Registration::Impl::descendFromPrior(std::vector<Hypothesis>& all) {
  coarse_.assign(scan_, kCoarsePoints);
  // Wide for a start that is far off; narrow where most of the scan is not mapped, and pulls elsewhere.
  for (const double widest : {scales_.widest, scales_.near_first}) {
    const Eigen::Isometry3d T_far = fusedWithPrior(descendFarField(prior_.T_map_sensor, widest));
    if (!contains(all, T_far))
      addHypothesis(solveHypothesis(T_far), widest == scales_.widest ? 0.0 : kMargin, all);
  }
}

std::vector<Registration::Impl::Hypothesis> Registration::Impl::restart() {
  const Matrix6d spread = prior_.information.inverse();
  DescentOptions descent;
  descent.rotation_tied_above = scales_.tied_above;
  const double first = std::max(0.5 * scales_.widest, scales_.far_last);
  descent.scales = geometricScales(first, scales_.far_last, kRestartSteps);
  const auto starts = startsAround(prior_.T_map_sensor, spread, options_.restarts + 1, 0);
  const auto found = bestDistinct(descendAll(*long_range_, coarse_, starts, descent), kRestartsRefined,
                                  scales_.tolerance, scales_.tolerance / scales_.lever);
  iterations_ += static_cast<int>(starts.size() * descent.scales.size());
  std::vector<Hypothesis> all;
  for (const Candidate& candidate : found)
    all.push_back(solveHypothesis(fusedWithPrior(candidate.T_map_sensor)));
  return all;
}

std::vector<Registration::Impl::Hypothesis> Registration::Impl::restartNear(
    const std::vector<Hypothesis>& known) {
  const double sigma = scales_.near_first;
  PosePrior nearer = PosePrior::fromSigmas(prior_.T_map_sensor, sigma, sigma / scales_.lever);
  nearer.information += prior_.information;
  std::vector<Hypothesis> found;
  for (const auto& T :
       startsAround(prior_.T_map_sensor, nearer.information.inverse(), kNearRestarts + 1, 0)) {
    const Hypothesis h = solveHypothesis(T);
    if (!contains(known, h.stage.T_map_sensor) && !contains(found, h.stage.T_map_sensor)) found.push_back(h);
  }
  sortByCost(found.begin(), found.end());
  found.resize(std::min(found.size(), kNearRestartsRefined));
  return found;
}

Eigen::Isometry3d Registration::Impl::descendFarField(const Eigen::Isometry3d& T_start, double most) {
  const NormalEquations start = linearize(*long_range_, coarse_, coarse_.size(), T_start, ResidualModel());
  ++iterations_;
  if (start.valid == 0) return T_start;
  const double widest = std::min(most, kScalePerRms * std::sqrt(start.squares / start.valid));
  DescentOptions descent;
  for (double scale = widest; scale > scales_.near_second; scale *= kScaleFactor) {
    descent.scales.insert(descent.scales.end(), kStepsPerScale, scale);
  }
  descent.rotation_tied_above = scales_.tied_above;
  iterations_ += static_cast<int>(descent.scales.size());
  return descend(*long_range_, coarse_, T_start, descent).T_map_sensor;
}

}  // namespace ttsdf
