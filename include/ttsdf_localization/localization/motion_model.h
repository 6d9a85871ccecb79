#pragma once
// The prior of the next scan: the last correction carried on by odometry, or by the last velocity where there
// is none.

#include <optional>

#include "ttsdf_localization/localization/localization_types.h"
#include "ttsdf_localization/localization/localizer_options.h"

namespace ttsdf {

struct Prediction {
  Eigen::Isometry3d T_map_base = Eigen::Isometry3d::Identity();
  Matrix6d covariance = Matrix6d::Zero();  ///< left perturbation [rotation; translation] about the base
};

/// Not thread-safe. Times are the scans' stamps.
class MotionModel {
 public:
  explicit MotionModel(MotionOptions options = {}) : options_(std::move(options)) {}

  void reset() { *this = MotionModel(options_); }
  /// The velocity is no longer known.
  void stop() { twist_.setZero(), twist_interval_.reset(); }
  bool hasPose() const { return last_.has_value(); }

  /// Pose of the base at the scan's stamp. Empty without a pose, or without an external prior where one is
  /// asked for.
  std::optional<Prediction> predict(const LocalizerScan& scan) const;
  /// The same for a pose from outside.
  Prediction predict(const PoseGuess& guess, const LocalizerScan& scan) const;

  /// A tracked pose: the velocity follows from the one before. `measured`: the scan fixed all of it.
  void correct(const LocalizerScan& scan, const Eigen::Isometry3d& T_map_base, const Matrix6d& covariance,
               bool measured = true);
  /// How far the position may be off along directions that this scan does not fix [m]: without odometry
  /// they are a guess since the last scan that fixed them. 0 with odometry.
  double guessedSigma(const LocalizerScan& scan) const;
  /// Whether scans that would have measured the pose are missing before this one: they came, and did not fix
  /// it, were rejected, or did not come.
  bool isBack(const LocalizerScan& scan) const;
  /// A pose found by a search: the velocity is unknown.
  void setPose(const LocalizerScan& scan, const Eigen::Isometry3d& T_map_base, const Matrix6d& covariance);

  /// Twist of the base in its own frame [rad/s; m/s]; zero when unknown.
  const Vector6d& twist() const { return twist_; }
  /// Of the last pose that was fixed in all directions, or set.
  double measuredStamp() const { return last_ ? last_->measured : 0.0; }
  double lastStamp() const { return last_ ? last_->stamp : 0.0; }
  const Eigen::Isometry3d& lastPose() const { return last_->T_map_base; }
  /// Last known correction of the odometry, T_map_odom.
  const std::optional<Eigen::Isometry3d>& correction() const { return T_map_odom_; }
  void setOptions(const MotionOptions& options) { options_ = options; }

 private:
  struct Fix {
    double stamp;
    Eigen::Isometry3d T_map_base;
    Matrix6d covariance;
    std::optional<Eigen::Isometry3d> T_odom_base;
    double measured;  ///< stamp of the last pose that a scan or the odometry fixed in all directions
    Eigen::Isometry3d T_map_base_measured;  ///< that pose
    Matrix6d covariance_measured;
  };

  void remember(const LocalizerScan& scan, const Eigen::Isometry3d& T_map_base, const Matrix6d& covariance);
  bool hasOdometry(const LocalizerScan& scan) const;
  Matrix6d odometryNoise(const Eigen::Isometry3d& motion) const;
  Matrix6d velocityNoise(double seconds) const;

  /// Variances of the guessed motion against those of the options, at least 1: a hand shakes more than a
  /// robot.
  struct Unsteadiness {
    double rotation = 1.0, translation = 1.0;
  };
  /// Of the motion since the last measured pose.
  Matrix6d guessNoise(double stamp) const;
  void learnUnsteadiness(double stamp, const Eigen::Isometry3d& T_map_base, const Matrix6d& covariance);

  MotionOptions options_;
  std::optional<Fix> last_;
  std::optional<Eigen::Isometry3d> T_map_odom_;
  Vector6d twist_ = Vector6d::Zero();
  Unsteadiness unsteadiness_;
  std::optional<double> twist_interval_;  ///< that the twist is the mean of [s]; empty: not known
};

}  // namespace ttsdf
