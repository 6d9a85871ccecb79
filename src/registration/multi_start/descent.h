#pragma once
// The cheap descent of multi-start search: few points, a fixed number of damped Gauss-Newton steps, no
// bookkeeping.

#include <functional>
#include <limits>
#include <vector>

#include "../solver/linearizer.h"

namespace ttsdf {

struct Candidate {
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  double score = 1.0;
};

struct DescentOptions {
  std::vector<double> scales;  ///< Geman-McClure scale of every step [m]
  double score_scale = 0.05;   ///< scale of the final score [m]
  /// At larger scales the rotation is tied to the start's [m]. From far away surfaces say where to move
  /// before they say how to turn: a free rotation takes up the translation's error and ends in a local
  /// minimum.
  double rotation_tied_above = std::numeric_limits<double>::infinity();
  int points = std::numeric_limits<int>::max();  ///< of the scan at the most
  int threads = 1;
};

/// `steps` scales that fall from `first` to `last` by equal factors.
std::vector<double> geometricScales(double first, double last, int steps);

/// One descent.
Candidate descend(const DistanceField& field, const ScanBuffer& scan, const Eigen::Isometry3d& T_start,
                  const DescentOptions& options);

/// Every start; results in the order of the starts whatever the number of threads. `keep_going(done)` is
/// asked now and then by the calling thread; false ends early, the starts not reached keep score 1.
std::vector<Candidate> descendAll(const DistanceField& field, const ScanBuffer& scan,
                                  const std::vector<Eigen::Isometry3d>& starts, const DescentOptions& options,
                                  const std::function<bool(std::size_t)>& keep_going = {});

/// The best `count` candidates by score, none within `distance` [m] and `angle` [rad] of a better one, and
/// none that explains nothing (score 1).
std::vector<Candidate> bestDistinct(std::vector<Candidate> candidates, std::size_t count, double distance,
                                    double angle);

}  // namespace ttsdf
