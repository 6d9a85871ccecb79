#pragma once
// An independent look at an estimate: points that it was not made from, free space along the rays, and
// whether the scan would notice if the pose were another one.

#include <array>
#include <vector>

#include "../scales.h"
#include "../solver/minimizer.h"

namespace ttsdf {

/// Held-out points of a scan, in clusters that share their errors.
class HeldOut {
 public:
  HeldOut(const ScanBuffer& scan, double cluster_size);
  int size() const { return static_cast<int>(points_.cols()); }

  struct Losses {
    std::vector<float> loss;  ///< r^2 / (r^2 + s^2), or -1 where the map says nothing
    int known = 0, explained = 0;
  };
  Losses losses(const DistanceField& field, const Eigen::Isometry3d& T_map_sensor, const ResidualModel& model,
                double tolerance) const;
  /// How much more the scan is contradicted there than here, in standard errors of what clusters of points
  /// say.
  double evidence(const Losses& here, const Losses& there) const;

 private:
  Eigen::Matrix3Xf points_;  // sensor frame
  std::vector<int> cluster_;
  int clusters_ = 0;
};

struct Verification {
  double explained_ratio = 0.0;  ///< held-out points nearer than the tolerance / those in known space
  /// Least evidence [standard errors] against a pose that is off, along the directions that are not
  /// degenerate.
  double least_evidence = 100.0;
  double weakest = 100.0;  ///< the same of all directions that the prior leaves open
  int degenerate_directions = 0;
  std::array<bool, 6> without_information{};  ///< per direction of the information: none
  std::array<bool, 6> without_evidence{};     ///< the scan would not notice a pose that is off that way
  int open_directions = 0;  ///< degenerate, and the prior does not fix them to the tolerance either
  /// Poses along weak directions that explain the scan better.
  std::vector<Eigen::Isometry3d> better_poses;
};

Verification verify(const DistanceField& field, const ScanBuffer& scan, const HeldOut& held_out,
                    const Eigen::Isometry3d& T_map_sensor, const NormalEquations& equations,
                    const PosePrior& prior, const ResidualModel& model, const Scales& scales,
                    double degenerate_threshold);

/// What confidence is made of.
struct ConfidenceFeatures {
  double explained_ratio, blocked_ratio, unmapped_ratio, least_evidence;
};
/// Chance that a pose with these features is right [0, 1].
double confidence(const ConfidenceFeatures& features);

}  // namespace ttsdf
