#pragma once
// One registration, in three files: the way of a scan from priors to a result (registration.cpp), how a pose
// that explains the scan is found (hypotheses.cpp), and what is said about it (acceptance.cpp). Everything
// inside works relative to the field's origin.

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "scales.h"
#include "scan_buffer.h"
#include "solver/minimizer.h"
#include "ttsdf_localization/registration/registration.h"
#include "verification/verification.h"

namespace ttsdf {

class Registration::Impl {
 public:
  Impl(std::shared_ptr<const DistanceField> field, const RegistrationOptions& options,
       std::shared_ptr<const DistanceField> far);

  RegistrationResult align(const ScanPoints& points, const Eigen::Isometry3d& T_prior,
                           const std::optional<Matrix6d>& covariance);
  RegistrationResult alignFrom(const ScanPoints& points, const std::vector<Eigen::Isometry3d>& starts,
                               const PosePrior& prior);
  const RegistrationOptions& options() const { return options_; }
  const DistanceField& field() const { return *map_; }
  const DistanceField& nearFarField() const { return *field_; }
  const std::shared_ptr<const DistanceField>& longRangeField() const { return long_range_; }

 private:
  /// Log likelihood that another hypothesis has to gain.
  static constexpr double kMargin = 2.0;

  /// A pose with what speaks for it.
  struct Hypothesis {
    StageResult stage;
    Eigen::Isometry3d T_blocked = Eigen::Isometry3d::Identity();  ///< pose at which `blocked` was seen
    double blocked = 0.0;
    double cost = 0.0;  ///< negative log likelihood of scan and prior, up to a constant
  };

  // registration.cpp
  RegistrationResult prepareScan(const ScanPoints& points, const Eigen::Isometry3d& T);
  bool usable(const Eigen::Isometry3d& T) const;
  PosePrior defaultPrior(const Eigen::Isometry3d& T) const;
  void solveGaussNewton(const Eigen::Isometry3d& T_prior, RegistrationResult& result);
  /// The map itself first, from the prior. Where that does not explain the scan well, the far field and
  /// further starts are other hypotheses, and count if they explain it better.
  void solveFromPrior(RegistrationResult& result);
  void solveFromStarts(const std::vector<Eigen::Isometry3d>& starts, RegistrationResult& result);
  void refineAndVerify(Hypothesis& best, RegistrationResult& result);

  // hypotheses.cpp
  ResidualModel model(double scale) const;
  StageOptions stageOptions(double scale, int points, int iterations) const;
  /// Where a fit does not fix the pose it goes back to the prior.
  Eigen::Isometry3d fusedWithPrior(const Eigen::Isometry3d& T);
  /// The map itself on a part of the points, the kernel as wide as the residuals at the start ask for.
  Hypothesis solveHypothesis(const Eigen::Isometry3d& T_start);
  void checkRays(Hypothesis& h) const;
  void evaluateCost(Hypothesis& h) const;
  /// The other one in place of the best, if it is better by more than the margin.
  static bool replaceIfBetter(const Hypothesis& other, double margin, Hypothesis& best);
  template <class Iterator>
  static void sortByCost(Iterator begin, Iterator end) {
    std::stable_sort(begin, end, [](const Hypothesis& a, const Hypothesis& b) { return a.cost < b.cost; });
  }
  /// Whether one of them is at that pose.
  bool contains(const std::vector<Hypothesis>& all, const Eigen::Isometry3d& T) const;
  /// One more; the best, with that margin, stays in front.
  static void addHypothesis(const Hypothesis& other, double margin, std::vector<Hypothesis>& all);
  /// How badly a pose explains the scan [0, 2]: by the points in known space, because a map with gaps
  /// explains no scan as a whole, and by what the rays went through.
  static double knownSpaceScore(const Hypothesis& h);
  /// The kernel narrowed with the spread of the residuals on a part of the points, the last stage on all but
  /// those held out: outliers, as edges that the map rounds, then count for less.
  void refine(StageResult& best);
  /// Adds what descents in the far field find from the prior.
  void descendFromPrior(std::vector<Hypothesis>& all);
  /// A local minimum shows by its score: descents in the far field from poses around the prior, the best of
  /// what they find.
  std::vector<Hypothesis> restart();
  /// The far field pulls a scan that is mostly unmapped to where more of the map is. In the map alone, from
  /// poses that lie nearer to the prior: the best of what is found beside those known.
  std::vector<Hypothesis> restartNear(const std::vector<Hypothesis>& known);
  /// Descends in the far field. The widest kernel is a few times the residual of the start, `most` [m] at
  /// the most.
  Eigen::Isometry3d descendFarField(const Eigen::Isometry3d& T_start, double most);

  // acceptance.cpp
  /// What the scan says about a degenerate direction is worth little, or nothing at all.
  Vector6d measuredInformation(const Verification& verification, const StageResult& stage,
                               const InformationAnalysis& info) const;
  /// Of a direction along which the scan would not notice a pose that is off [m].
  double unnoticedSigma() const { return 0.5 * scales_.probe; }
  /// Along degenerate directions the pose goes back to the prior.
  void restorePrior(const Verification& verification, StageResult& stage) const;
  Verification verifyStage(const StageResult& stage, const HeldOut& held_out) const;
  /// Statistics and reason.
  void fillStatistics(const StageResult& stage, RegistrationResult& result) const;
  /// The verification decides whether the pose may be used.
  void accept(const Hypothesis& best, const Verification& verification, RegistrationResult& result);
  /// Of the scan alone, about the sensor's position.
  Matrix6d measuredCovariance(const StageResult& stage) const;
  /// With the prior and the errors of the map, about the sensor's position.
  Matrix6d posteriorCovariance(const StageResult& stage, const Verification& verification) const;

  std::shared_ptr<const DistanceField> map_;
  std::shared_ptr<const DistanceField> field_;  ///< the map as scans ask it: with its far field
  std::shared_ptr<const DistanceField> long_range_;
  bool uses_far_field_ = false;
  bool facing_ = false;
  RegistrationOptions options_;
  ScanBuffer scan_, coarse_;
  Scales scales_;
  PosePrior prior_;
  int iterations_ = 0;
};

}  // namespace ttsdf
