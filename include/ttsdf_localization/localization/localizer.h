#pragma once
// Localization of a stream of scans in one map: prior, registration, gates, and what to do when a scan does
// not fit.
//
//                      setMap            guess fits, confirmed              scans rejected
//   no map ----------------> waiting ------------------------> tracking <----------------> degraded
//                              ^  guess -> relocalizing            ^                           | lost_after_*
//                              |                                   | confirmed                 v
//                              +--- limits reached <--- relocalizing <--- place found ------ lost
//                                                                          near or globally
//   tracking, degraded: the first fixed pose after a long guess is searched and confirmed -> relocalizing
//
// No ROS, no threads, no clock: time is the stamps. The node and the offline localizer run the same class.
// Not thread-safe; a GlobalJob is independent of it and may run in another thread.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ttsdf_localization/localization/gates.h"
#include "ttsdf_localization/localization/localization_types.h"
#include "ttsdf_localization/localization/localizer_options.h"
#include "ttsdf_localization/localization/motion_model.h"
#include "ttsdf_localization/localization/pose_covariance.h"

namespace ttsdf {

/// Finds the place of a scan without a prior; `gravity`: down in the sensor frame, if it is known.
using GlobalSearch =
    std::function<RegistrationResult(const ScanPoints& points, const std::optional<Eigen::Vector3d>& gravity,
                                     const ProgressCallback& progress)>;

/// A global localization of one scan: takes seconds, owns all it needs.
class GlobalJob {
 public:
  GlobalJob(int id, std::shared_ptr<const DistanceField> field, std::shared_ptr<const DistanceField> far,
            LocalizerScan scan, std::optional<Eigen::Vector3d> gravity, const LocalizerOptions& options);
  /// Runs to the end; never throws for bad points. `progress` returns false to cancel.
  void run(const ProgressCallback& progress = {});
  /// The same by a search of its own, in more than the map in use.
  void runWith(const GlobalSearch& search, const ProgressCallback& progress) {
    result_ = search(scan_.points, gravity_, progress);
  }

  int id() const { return id_; }
  const LocalizerScan& scan() const { return scan_; }
  const RegistrationResult& result() const { return result_; }
  /// Pose of the base found, valid if result().success.
  Eigen::Isometry3d T_map_base() const { return result_.T_map_sensor * scan_.T_base_sensor.inverse(); }

 private:
  int id_;
  std::shared_ptr<const DistanceField> field_, far_;
  LocalizerScan scan_;
  std::optional<Eigen::Vector3d> gravity_;  ///< down in the sensor frame
  RegistrationOptions registration_;
  GlobalOptions global_;
  Eigen::Vector3d map_down_;
  RegistrationResult result_;
};

/// A field ready for registration.
struct PreparedMap {
  std::shared_ptr<const DistanceField> field;
  std::unique_ptr<Registration> registration;  ///< as the options say: from afar
  std::unique_ptr<Registration> tracker;       ///< the last stages only: from a prior of a few centimetres
};

class Localizer {
 public:
  /// Throws std::invalid_argument for options out of range.
  explicit Localizer(LocalizerOptions options = {});

  /// What has to be computed before a field can be used; takes a while, so do it in another thread than the
  /// scans. Throws std::invalid_argument for a null field or bad options.
  /// `keep_going` is asked every few milliseconds; false ends it with Cancelled.
  static PreparedMap prepare(std::shared_ptr<const DistanceField> field, const RegistrationOptions& options,
                             const KeepGoing& keep_going = {});
  /// The same with a far field that is there already (null: there is none), and a field that is warm.
  static PreparedMap prepareWith(std::shared_ptr<const DistanceField> field,
                                 std::shared_ptr<const DistanceField> far,
                                 const RegistrationOptions& options);
  /// Puts a map into use, at once; the pose is kept and has to prove itself.
  void setMap(PreparedMap map);
  void setMap(std::shared_ptr<const DistanceField> field) {
    setMap(prepare(std::move(field), options_.registration));
  }
  /// More or fewer maps of one atlas (atlas/atlas_field.h): the frame is the same, so the pose, the state,
  /// what is usual, and a search that runs stay as they are.
  void exchangeMap(PreparedMap map);
  bool hasMap() const { return registration_ != nullptr; }

  /// Replaces whatever is known about the pose; tried on the next scans.
  void setGuess(PoseGuess guess);
  /// The next scan. Never throws for bad points.
  LocalizationUpdate process(const LocalizerScan& scan);
  /// Tries a guess on a scan that may have been processed already.
  LocalizationUpdate relocalize(const LocalizerScan& scan, PoseGuess guess);

  /// No scan was used for `seconds`, where one comes every `usual_interval` [s] otherwise: degraded, then
  /// lost. Empty: nothing changes by it.
  std::optional<LocalizationUpdate> withoutScans(double seconds, double usual_interval);

  /// Starts a global localization: run the job anywhere, then hand it back. Throws std::logic_error without a
  /// map.
  GlobalJob beginGlobal(const LocalizerScan& scan, const std::optional<Eigen::Vector3d>& gravity);
  LocalizationUpdate applyGlobal(const GlobalJob& job);
  bool globalRunning() const { return global_running_; }

  /// The clock went back (a bag loops): stamps and velocity are forgotten, map and correction are tried
  /// again.
  void timeJumpedBack();
  /// Forgets the pose and every guess; keeps the map.
  void reset();
  /// New gates, motion and recovery options (what is safe to change while running). Throws
  /// std::invalid_argument.
  void setOptions(const LocalizerOptions& options);

  LocalizerState state() const { return state_; }
  const LocalizerOptions& options() const { return options_; }
  /// Last pose of the base that was published as good; empty if there was none since the start or the last
  /// reset.
  std::optional<PoseGuess> lastPose() const;

 private:
  // localizer.cpp: what comes in.
  LocalizationUpdate handle(const LocalizerScan& scan);
  LocalizationUpdate emptyUpdate(const LocalizerScan& scan) const;
  LocalizationUpdate withState(LocalizationUpdate& update) const;

  // localizer_tracking.cpp: a scan's way while the pose is known.
  LocalizationUpdate track(const LocalizerScan& scan);
  RegistrationResult alignNear(const LocalizerScan& scan, const Prediction& prior);
  static RegistrationResult alignWith(Registration& registration, const LocalizerScan& scan,
                                      const PoseEstimate& prior);
  /// Whether the motion explains this pose, or the scan fits well enough without that.
  Rejection checkPlausible(const LocalizerScan& scan, const Prediction& prior,
                           const RegistrationResult& result) const;
  /// Whether something measured the pose in all directions; without odometry a guess is good for a moment.
  Rejection checkMeasured(const LocalizerScan& scan, const RegistrationResult& result) const;
  /// The first scan that fixes the pose after motion was guessed for long: another place may fit as well.
  bool returnsFromGuess(const LocalizerScan& scan, const RegistrationResult& result) const;
  LocalizationUpdate returnFromGuess(const LocalizerScan& scan, const Prediction& prior);
  /// The pose goes on by guess, and is not published.
  LocalizationUpdate followGuess(const LocalizerScan& scan, const Rejection& rejection,
                                 LocalizationUpdate& update);
  LocalizationUpdate accept(const LocalizerScan& scan, const Prediction& prior, LocalizationUpdate& update);
  /// A pose found: good after the confirmation scans that agree for at least `seconds`, by the inlier
  /// ratio it was found with.
  LocalizationUpdate acceptFound(const LocalizerScan& scan, LocalizationUpdate& update, double seconds);
  LocalizationUpdate startConfirming(const LocalizerScan& scan, double seconds, LocalizationUpdate& update);
  bool confirming() const;
  /// Whether a pose found and those since move as the odometry does: in a place that only looks alike they
  /// drift apart, by little from scan to scan.
  Rejection checkSinceFound(const LocalizerScan& scan, const LocalizationUpdate& update) const;
  void stopConfirming();
  LocalizationUpdate markValid(const LocalizerScan& scan, LocalizationUpdate& update);
  LocalizationUpdate reject(const LocalizerScan& scan, const Rejection& rejection,
                            LocalizationUpdate& update);
  void becomeLost(int searches_done);
  void forgetUsualFit();
  /// Least inlier ratio while tracking, and after a search near the last pose.
  double trackingInliers() const;
  double recoveryInliers() const;
  static void fillPose(const LocalizerScan& scan, const PoseEstimate& sensor, LocalizationUpdate& update);

  // localizer_recovery.cpp: the way back.
  LocalizationUpdate tryGuesses(const LocalizerScan& scan);
  LocalizationUpdate recover(const LocalizerScan& scan);
  LocalizationUpdate escalate(const LocalizerScan& scan, LocalizationUpdate& update);
  LocalizationUpdate waitForPose(const LocalizerScan& scan);
  /// Searches around every guess; what fits best into `best`, or why none counts.
  Rejection searchGuesses(const LocalizerScan& scan, LocalizationUpdate& best);
  LocalizationUpdate searchAround(const LocalizerScan& scan, const Prediction& candidate,
                                  const SearchOptions& search);
  /// Whether neither the scan nor the prior tells the pose found from another one.
  bool isAmbiguous(const RegistrationResult& best, const Eigen::Isometry3d& T_prior,
                   const Matrix6d& covariance) const;
  bool fitsAlike(const LocalizationUpdate& a, const LocalizationUpdate& b) const;
  /// Held to what is usual, if that is known: a wrong place fits worse.
  Rejection checkFound(const LocalizationUpdate& found) const;
  Rejection checkFoundNearLast(const LocalizerScan& scan, const LocalizationUpdate& found) const;
  bool searchDue(double stamp, double period);
  Prediction recoveryPrior(const Prediction& prediction) const;
  Prediction withLeastSpread(Prediction prediction) const;

  LocalizerOptions options_;
  std::unique_ptr<Registration> registration_, tracker_;
  std::shared_ptr<const DistanceField> field_;
  MotionModel motion_;
  LocalizerState state_ = LocalizerState::kNoMap;

  double last_stamp_;                     ///< of the last scan taken
  double last_uninformative_stamp_;       ///< of the last rejected scan without information
  double confirmed_from_;                 ///< stamp from which on a pose found is good
  std::vector<PoseGuess> guesses_;        ///< to be tried; the first is trusted most
  std::optional<PoseGuess> start_guess_;  ///< the last one from outside, tried again after a time jump
  std::optional<PoseGuess> last_valid_;   ///< the last pose published as good
  double usual_inliers_ = 0.0;  ///< largest inlier ratio while tracking, slowly falling; 0: not known
  double usual_score_ = 1.0;    ///< smallest score, slowly rising; 1: not known
  int guess_attempts_ = 0;
  int confirmations_left_ = 0;
  double confirming_inliers_ = 0.0;  ///< least inlier ratio meanwhile
  double confirming_score_ = 1.0;    ///< worst score meanwhile
  PoseGuess found_;                  ///< what is confirmed
  int rejected_in_row_ = 0;
  double last_search_stamp_;
  int searches_done_ = 0;
  int globals_done_ = 0;
  double last_global_stamp_;
  bool global_running_ = false;
  int global_id_ = 0;
};

}  // namespace ttsdf
