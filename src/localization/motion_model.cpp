#include "ttsdf_localization/localization/motion_model.h"

#include <algorithm>
#include <cmath>

#include "ttsdf_localization/localization/pose_covariance.h"

namespace ttsdf {

namespace {
constexpr double kCalmSeconds = 2.0;  // in which what fast motion has shown is forgotten (1/e)
// Of a variance: ten standard deviations are no motion of a camera but a correction of the pose.
constexpr double kMostUnsteady = 100.0;

/// Mean square of `part` against its variances, at least `kept`.
double unsteadinessOf(const Eigen::Vector3d& part, const Eigen::Matrix3d& variances, double kept) {
  const double seen = part.squaredNorm() / variances.trace();
  return std::isfinite(seen) ? std::clamp(seen, kept, kMostUnsteady) : kept;
}

/// Twist of the body frame that takes T_a to T_b in `seconds`.
Vector6d bodyTwist(const Eigen::Isometry3d& T_a, const Eigen::Isometry3d& T_b, double seconds) {
  return logSe3(T_a.inverse() * T_b) / seconds;
}
}  // namespace

Matrix6d MotionModel::odometryNoise(const Eigen::Isometry3d& motion) const {
  const double distance = motion.translation().norm();
  const double angle = logSo3(motion.linear()).norm();
  return isotropicCovariance(std::hypot(options_.odometry_rotation_noise * angle,
                                        options_.odometry_rotation_noise_per_metre * distance),
                             options_.odometry_translation_noise * distance);
}

Matrix6d MotionModel::velocityNoise(double seconds) const {
  const double t = std::isfinite(seconds) ? std::abs(seconds) : 0.0;
  double rotation = options_.velocity_rotation_noise * t,
         translation = options_.velocity_translation_noise * t;
  if (twist_interval_) {
    // The mean velocity of an interval is the velocity of its middle.
    const double drift = 0.5 * t * (t + *twist_interval_);
    rotation = std::min(rotation, options_.angular_acceleration * drift);
    translation = std::min(translation, options_.acceleration * drift);
  }
  return isotropicCovariance(rotation, translation);
}

Matrix6d MotionModel::guessNoise(double stamp) const {
  Matrix6d noise = velocityNoise(stamp - last_->measured);
  noise.topLeftCorner<3, 3>() *= unsteadiness_.rotation;
  noise.bottomRightCorner<3, 3>() *= unsteadiness_.translation;
  return noise;
}

void MotionModel::learnUnsteadiness(double stamp, const Eigen::Isometry3d& T_map_base,
                                    const Matrix6d& covariance) {
  const double seconds = stamp - last_->stamp;
  if (!twist_interval_ || !(seconds > 0.0) || seconds > options_.max_extrapolation) return;
  const Matrix6d expected = last_->covariance_measured + covariance + velocityNoise(stamp - last_->measured);
  const Eigen::Isometry3d guess = last_->T_map_base * expSe3(seconds * twist_);
  const Eigen::Vector3d turned = logSo3(T_map_base.linear() * guess.linear().transpose());
  const Eigen::Vector3d moved = T_map_base.translation() - guess.translation();
  // By the step, not by the clock: while nothing is measured nobody sees the camera calm down.
  const double kept = std::exp(-seconds / kCalmSeconds);
  const auto faded = [&](double before) { return 1.0 + (before - 1.0) * kept; };
  unsteadiness_ = {
      unsteadinessOf(turned, expected.topLeftCorner<3, 3>(), faded(unsteadiness_.rotation)),
      unsteadinessOf(moved, expected.bottomRightCorner<3, 3>(), faded(unsteadiness_.translation))};
}

bool MotionModel::hasOdometry(const LocalizerScan& scan) const {
  return options_.prior == "odometry" && last_ && scan.T_odom_base && last_->T_odom_base;
}

double MotionModel::guessedSigma(const LocalizerScan& scan) const {
  if (!last_ || hasOdometry(scan) || options_.prior == "external") return 0.0;
  return std::sqrt(guessNoise(scan.stamp)(3, 3));
}

bool MotionModel::isBack(const LocalizerScan& scan) const {
  constexpr double kGap = 2.5;  // of the time between scans
  if (!last_) return false;
  return last_->measured < last_->stamp ||
         (twist_interval_ && scan.stamp - last_->stamp > kGap * *twist_interval_);
}

std::optional<Prediction> MotionModel::predict(const LocalizerScan& scan) const {
  if (options_.prior == "external") {
    if (!scan.T_map_base_prior) return std::nullopt;
    // Nobody says how good it is: as without odometry.
    const double seconds = last_ ? scan.stamp - last_->stamp : options_.max_extrapolation;
    const Matrix6d known = last_ ? last_->covariance : Matrix6d(Matrix6d::Zero());
    return Prediction{*scan.T_map_base_prior, known + velocityNoise(seconds)};
  }
  if (!last_) return std::nullopt;
  if (hasOdometry(scan)) {
    const Eigen::Isometry3d motion = last_->T_odom_base->inverse() * *scan.T_odom_base;
    return Prediction{last_->T_map_base * motion, last_->covariance + odometryNoise(motion)};
  }
  const double seconds = scan.stamp - last_->stamp;
  const double carried = std::clamp(seconds, 0.0, options_.max_extrapolation);
  return Prediction{last_->T_map_base * expSe3(carried * twist_),
                    last_->covariance_measured + guessNoise(scan.stamp)};
}

Prediction MotionModel::predict(const PoseGuess& guess, const LocalizerScan& scan) const {
  if (guess.T_odom_base && scan.T_odom_base) {
    const Eigen::Isometry3d motion = guess.T_odom_base->inverse() * *scan.T_odom_base;
    return {guess.T_map_base * motion, guess.covariance + odometryNoise(motion)};
  }
  return {guess.T_map_base, guess.covariance + velocityNoise(scan.stamp - guess.stamp)};
}

void MotionModel::correct(const LocalizerScan& scan, const Eigen::Isometry3d& T_map_base,
                          const Matrix6d& covariance, bool measured) {
  const std::optional<Fix> before = last_;
  if (last_ && measured && !hasOdometry(scan)) learnUnsteadiness(scan.stamp, T_map_base, covariance);
  measured = measured || hasOdometry(scan);
  if (last_) {
    const double seconds = scan.stamp - last_->stamp;
    // Back from guesses: what they were off by is no motion, the mean since the last measured pose is.
    const bool back = measured && last_->measured < last_->stamp;
    stop();
    if (seconds > 1e-6 && seconds <= options_.max_extrapolation) {  // too long a time does not tell
      if (scan.T_odom_base && last_->T_odom_base) {
        // Differences of odometry are smoother than differences of corrections.
        twist_interval_ = seconds;
        twist_ = bodyTwist(*last_->T_odom_base, *scan.T_odom_base, seconds);
      } else {
        twist_interval_ = back ? scan.stamp - last_->measured : seconds;
        twist_ =
            bodyTwist(back ? last_->T_map_base_measured : last_->T_map_base, T_map_base, *twist_interval_);
      }
    }
  }
  remember(scan, T_map_base, covariance);
  if (measured || !before) return;
  last_->measured = before->measured;
  last_->T_map_base_measured = before->T_map_base_measured;
  last_->covariance_measured = before->covariance_measured;
}

void MotionModel::setPose(const LocalizerScan& scan, const Eigen::Isometry3d& T_map_base,
                          const Matrix6d& covariance) {
  stop();
  T_map_odom_.reset();
  remember(scan, T_map_base, covariance);
}

void MotionModel::remember(const LocalizerScan& scan, const Eigen::Isometry3d& T_map_base,
                           const Matrix6d& covariance) {
  last_ = Fix{scan.stamp, T_map_base, covariance, scan.T_odom_base, scan.stamp, T_map_base, covariance};
  if (scan.T_odom_base) T_map_odom_ = T_map_base * scan.T_odom_base->inverse();
}

}  // namespace ttsdf
