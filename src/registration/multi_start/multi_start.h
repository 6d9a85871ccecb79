#pragma once
// The cheap part of every search: many starts descend in the far field, the better ones in the map, and few
// are left for a registration on all points. Work is bounded by counts: the answer does not depend on the
// machine's load.

#include <algorithm>
#include <functional>
#include <vector>

#include "../scales.h"
#include "../scan_buffer.h"
#include "descent.h"
#include "ttsdf_localization/registration/registration.h"

namespace ttsdf {

class MultiStart {
 public:
  struct Options {
    double first = 1.0;       ///< widest kernel, in radii of the scan: starts so far off are pulled in
    double kept_part = 1.0;   ///< of the starts after a few steps; the others are given up
    std::size_t refined = 8;  ///< places to return at the most
    int retries = 0;          ///< further descents in the map from around each of the better places
    int threads = 1;
  };
  using KeepGoing = std::function<bool(double share)>;

  /// At most about `coarse_points` of the scan are used. `registration` must outlive this.
  MultiStart(const Registration& registration, const ScanPoints& points, int coarse_points);

  int points() const { return scan_.size(); }
  double radius() const { return scan_.radius(); }
  const DistanceField& coarse() const { return coarse_; }
  /// A sensor is at least so far from the nearest surface [m].
  double clearance() const { return std::min(5.0 * scales_.voxel, 0.1 * scan_.radius()); }

  /// The best distinct places that the starts lead to, best first, in the map's frame. `starts` are relative
  /// to the field's origin. `keep_going` is asked now and then; false ends early with the best so far.
  std::vector<Eigen::Isometry3d> places(const std::vector<Eigen::Isometry3d>& starts, const Options& options,
                                        const KeepGoing& keep_going = {}) const;

 private:
  /// `count` poses about each place, so far from it that a local minimum nearby is left.
  std::vector<Eigen::Isometry3d> around(const std::vector<Candidate>& places, int count) const;

  const DistanceField& near_;  ///< the map, its far field away from the surfaces
  const DistanceField& coarse_;
  ScanBuffer scan_;
  Scales scales_;
};

}  // namespace ttsdf
