#pragma once
// The perturbation sweep and its log: one CSV row per estimate, written as it comes, so that an interrupted
// run goes on where it stopped.

#include <functional>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "ttsdf_localization/evaluation/method.h"
#include "ttsdf_localization/evaluation/perturbation.h"
#include "ttsdf_localization/evaluation/scan_set.h"
#include "ttsdf_localization/evaluation/statistics.h"

namespace ttsdf {

/// An estimate within this distance of the truth is a success [m]; the paper counts none, it shows quartiles.
inline constexpr double kSuccessDistance = 0.05;

struct SweepRecord {
  std::string dataset, method, scan;
  PerturbationKind kind = PerturbationKind::kTranslation;
  double magnitude = 0.0;                            ///< [m] or [rad], by kind
  int direction = 0;                                 ///< number of the direction, from 0
  double translation_error = 0.0;                    ///< [m]
  double rotation_error = 0.0;                       ///< [rad]
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< estimated position in the true sensor frame [m]:
                                                     ///< shows bias where the errors above only show size
  bool accepted = false;                             ///< what the method said of its own estimate
  std::string reason;
  int iterations = 0;
  double milliseconds = 0.0;      ///< wall clock
  double cpu_milliseconds = 0.0;  ///< processor time: fair on a busy machine for methods of one thread
  /// Squared Mahalanobis distance of the true pose under the method's covariance; NaN if it has none.
  double mahalanobis_squared = std::numeric_limits<double>::quiet_NaN();
  double confidence = std::numeric_limits<double>::quiet_NaN();  ///< as the method said; NaN if it does not

  bool success() const { return translation_error < kSuccessDistance; }
};

/// The rows of a log file. A last row cut off by an interruption is left out. Throws std::runtime_error
/// naming file and line for anything else that is no such log; an absent file is an empty log.
std::vector<SweepRecord> readSweepLog(const std::string& path);

/// Appends to a log file; what is in it already counts as done.
class SweepLog {
 public:
  /// Throws std::runtime_error (cannot read, cannot write).
  explicit SweepLog(const std::string& path);
  /// By dataset, method, scan, kind, magnitude and direction.
  bool contains(const SweepRecord& key) const;
  /// Written at once. Throws std::runtime_error if the disk refuses.
  void append(const SweepRecord& record);
  const std::vector<SweepRecord>& records() const { return records_; }

 private:
  std::string path_;
  std::vector<SweepRecord> records_;
  std::set<std::string> keys_;
};

struct SweepRun {
  std::string dataset, method;              ///< labels
  std::optional<Eigen::Vector3d> map_down;  ///< down direction in the map frame: gives methods a gravity hint
  double gravity_sigma = 0.0;               ///< the hint's error per axis [rad]
  int repeat = 1;                           ///< times are the median of as many calls
};

/// Runs one method over every scan and perturbation of the plan that the log does not hold yet. `progress`
/// gets the share done and returns false to stop early; the log stays valid.
void runSweep(const SweepRun& run, Method& method, const std::vector<EvaluationScan>& scans,
              const SweepPlan& plan, SweepLog& log, const std::function<bool(double)>& progress = {});

/// One line of the table.
struct SweepSummary {
  std::string dataset, method;
  PerturbationKind kind = PerturbationKind::kTranslation;
  double magnitude = 0.0;
  std::size_t runs = 0;
  double success_rate = 0.0;        ///< share of runs, 0 to 1
  Quartiles translation, rotation;  ///< over all runs, failures included [m], [rad]
  Quartiles translation_of_successes,
      rotation_of_successes;  ///< the paper leaves failures out; NaN without a success
  double milliseconds = 0.0, cpu_milliseconds = 0.0;  ///< medians
};

/// Datasets and methods in the order of their first record; translations before rotations, rising magnitude.
std::vector<SweepSummary> summarize(const std::vector<SweepRecord>& records);
/// A table for people, one line per summary.
std::string toTable(const std::vector<SweepSummary>& summaries);

}  // namespace ttsdf
