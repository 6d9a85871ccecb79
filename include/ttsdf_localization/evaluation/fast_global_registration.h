#pragma once
// Fast Global Registration from its paper: Zhou, Park, Koltun, "Fast Global Registration", ECCV 2016. One
// robust objective over correspondences that are never updated; graduated non-convexity takes the place of
// sampling. Where the correspondences come from (FPFH) is not this file's business.

#include <Eigen/Geometry>
#include <utility>
#include <vector>

#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

/// Indices of a source and a target point that are held to be the same.
using Correspondence = std::pair<int, int>;

struct FastGlobalOptions {
  double fgr_distance = 0.05;           ///< delta: where the annealing of the kernel ends [m]
  double fgr_tuple_similarity = 0.9;    ///< tau: edges of a pair of triangles may differ by this ratio
  int fgr_max_tuples = 1000;            ///< triangles kept at the most
  int fgr_tuple_trials_per_pair = 100;  ///< triangles tried per correspondence
  int fgr_iterations_per_scale = 4;     ///< before mu is halved
  int fgr_min_matches = 10;             ///< correspondences after the tuple test; fewer is no answer
  int fgr_seed = 1;
};
const OptionTable<FastGlobalOptions>& fastGlobalOptionTable();

/// Pairs that are each other's nearest: `nearest_target[i]` is the match of source i, `nearest_source[j]` the
/// match of target j; -1 for none. (The paper's reciprocity test.)
std::vector<Correspondence> mutualMatches(const std::vector<int>& nearest_target,
                                          const std::vector<int>& nearest_source);

/// The paper's tuple test: random triples of correspondences whose triangles have compatible edges. Points
/// are 3 x n [m]. Returns their members, in the order found, with repetitions.
std::vector<Correspondence> tupleTest(const Eigen::Matrix3Xf& source, const Eigen::Matrix3Xf& target,
                                      const std::vector<Correspondence>& matches,
                                      const FastGlobalOptions& options);

/// Minimises sum rho(|q - T p|) with the scaled Geman-McClure kernel, mu from the squared diameter of the
/// points down to delta^2. Returns T_target_source. Throws std::invalid_argument for fewer than three
/// correspondences.
Eigen::Isometry3d alignCorrespondences(const Eigen::Matrix3Xf& source, const Eigen::Matrix3Xf& target,
                                       const std::vector<Correspondence>& matches,
                                       const FastGlobalOptions& options);

}  // namespace ttsdf
