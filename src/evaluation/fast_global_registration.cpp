#include "ttsdf_localization/evaluation/fast_global_registration.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <stdexcept>
#include <string>

#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

namespace {

constexpr int kFinalIterations = 40;  // at mu = delta^2, where a step usually ends the loop before
constexpr double kStepEpsilon = 1e-7;

double squaredDiameter(const Eigen::Matrix3Xf& points, const std::vector<Correspondence>& matches,
                       bool of_source) {
  Eigen::AlignedBox3d box;
  for (const auto& match : matches) {
    box.extend(points.col(of_source ? match.first : match.second).cast<double>().eval());
  }
  return box.diagonal().squaredNorm();
}

// One Gauss-Newton step at fixed weights (paper, equations 6 and 8): returns the twist of the left update.
Vector6d step(const Eigen::Matrix3Xf& source, const Eigen::Matrix3Xf& target,
              const std::vector<Correspondence>& matches, const Eigen::Isometry3d& T, double mu) {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  for (const auto& [i, j] : matches) {
    const Eigen::Vector3d moved = T * source.col(i).cast<double>();
    const Eigen::Vector3d residual = moved - target.col(j).cast<double>();
    const double root = mu / (mu + residual.squaredNorm());
    const double weight = root * root;  // the line process l_pq
    Eigen::Matrix<double, 3, 6> jacobian;
    jacobian << -hat(moved), Eigen::Matrix3d::Identity();
    hessian.noalias() += weight * jacobian.transpose() * jacobian;
    gradient.noalias() += weight * jacobian.transpose() * residual;
  }
  const double damping = 1e-12 * std::max(hessian.trace(), 1e-12);
  hessian.diagonal().array() += damping;
  return -hessian.ldlt().solve(gradient);
}

bool similar(double a, double b, double ratio) { return a > ratio * b && b > ratio * a; }

}  // namespace

const OptionTable<FastGlobalOptions>& fastGlobalOptionTable() {
  using O = FastGlobalOptions;
  static const OptionTable<O> kTable =
      OptionTable<O>()
          .add("fgr_distance", &O::fgr_distance, 1e-6, 100.0, "m", "Kernel width at which annealing ends.")
          .add("fgr_tuple_similarity", &O::fgr_tuple_similarity, 0.0, 1.0, "",
               "Ratio by which the edges of matching triangles may differ.")
          .add("fgr_max_tuples", &O::fgr_max_tuples, 1, 1000000, "", "Matching triangles kept.")
          .add("fgr_tuple_trials_per_pair", &O::fgr_tuple_trials_per_pair, 1, 100000, "",
               "Triangles tried per correspondence.")
          .add("fgr_iterations_per_scale", &O::fgr_iterations_per_scale, 1, 1000, "",
               "Steps before the kernel narrows.")
          .add("fgr_min_matches", &O::fgr_min_matches, 3, 1000000, "",
               "Fewer correspondences give no answer.")
          .add("fgr_seed", &O::fgr_seed, 0, 1000000000, "", "Seed of the triangles.");
  return kTable;
}

std::vector<Correspondence> mutualMatches(const std::vector<int>& nearest_target,
                                          const std::vector<int>& nearest_source) {
  std::vector<Correspondence> matches;
  for (std::size_t i = 0; i < nearest_target.size(); ++i) {
    const int j = nearest_target[i];
    if (j < 0) continue;
    if (nearest_source.at(static_cast<std::size_t>(j)) == static_cast<int>(i)) {
      matches.emplace_back(static_cast<int>(i), j);
    }
  }
  return matches;
}

std::vector<Correspondence> tupleTest(const Eigen::Matrix3Xf& source, const Eigen::Matrix3Xf& target,
                                      const std::vector<Correspondence>& matches,
                                      const FastGlobalOptions& options) {
  std::vector<Correspondence> kept;
  if (matches.size() < 3) return kept;
  std::mt19937 random(static_cast<std::uint32_t>(options.fgr_seed));
  const auto draw = [&] { return matches[random() % matches.size()]; };
  const auto edgesAgree = [&](const Correspondence& a, const Correspondence& b) {
    const double in_source = (source.col(a.first) - source.col(b.first)).norm();
    const double in_target = (target.col(a.second) - target.col(b.second)).norm();
    return similar(in_source, in_target, options.fgr_tuple_similarity);
  };
  const std::size_t trials = matches.size() * static_cast<std::size_t>(options.fgr_tuple_trials_per_pair);
  const std::size_t wanted = 3 * static_cast<std::size_t>(options.fgr_max_tuples);
  for (std::size_t n = 0; n < trials && kept.size() < wanted; ++n) {
    const Correspondence a = draw(), b = draw(), c = draw();
    if (edgesAgree(a, b) && edgesAgree(b, c) && edgesAgree(c, a)) kept.insert(kept.end(), {a, b, c});
  }
  return kept;
}

Eigen::Isometry3d alignCorrespondences(const Eigen::Matrix3Xf& source, const Eigen::Matrix3Xf& target,
                                       const std::vector<Correspondence>& matches,
                                       const FastGlobalOptions& options) {
  if (matches.size() < 3) {
    throw std::invalid_argument("fast global registration: got " + std::to_string(matches.size()) +
                                " correspondences, wanted at least 3");
  }
  const double mu_end = options.fgr_distance * options.fgr_distance;
  double mu = std::max(squaredDiameter(source, matches, true), squaredDiameter(target, matches, false));
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (; mu > mu_end; mu *= 0.5) {
    for (int n = 0; n < options.fgr_iterations_per_scale; ++n) {
      T = expSe3(step(source, target, matches, T, mu)) * T;
    }
  }
  for (int n = 0; n < kFinalIterations; ++n) {
    const Vector6d xi = step(source, target, matches, T, mu_end);
    T = expSe3(xi) * T;
    if (xi.norm() < kStepEpsilon) break;
  }
  return T;
}

}  // namespace ttsdf
