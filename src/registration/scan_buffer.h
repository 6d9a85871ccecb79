#pragma once
// A scan as registration wants it: finite points only, structure of arrays, relative to their centroid, and
// ordered so that every prefix of 1/8, 1/4, 1/2 of the points is an even sub-sample (coarse-to-fine costs no
// copying).

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "ttsdf_localization/sensor/sensor_model.h"

namespace ttsdf {

class ScanBuffer {
 public:
  /// Points are weighed by the sensor's noise at their range, beside `floor` that everything else is off by
  /// [m], from the next assign on. Without a call all count alike.
  void setSensor(const SensorModel& sensor, double floor) { sensor_ = sensor, floor_ = floor; }

  /// Takes at most `max_points` of the finite columns of `points` (3 x n, sensor frame), evenly by stride.
  void assign(const Eigen::Matrix3Xf& points, int max_points);

  /// The even prefix of another scan of at least `wanted` points, about its own centroid.
  void assign(const ScanBuffer& scan, int wanted);

  int size() const { return static_cast<int>(x_.size()); }
  const float* x() const { return x_.data(); }
  const float* y() const { return y_.data(); }
  const float* z() const { return z_.data(); }
  /// Trust in (0, 1] by range, as the sensor's model says.
  const float* weight() const { return weight_.data(); }
  /// Standard deviation of point n along its ray [m], as the sensor's model says; 0 without one.
  double noise(int n) const {
    return floor_ * std::sqrt(1.0 / static_cast<double>(weight_[static_cast<std::size_t>(n)]) - 1.0);
  }
  /// Sensor frame [m]; point n is centroid + (x[n], y[n], z[n]).
  const Eigen::Vector3d& centroid() const { return centroid_; }
  /// Mean of the unit vectors to the points, sensor frame (Viewpoint::view).
  const Eigen::Vector3d& view() const { return view_; }
  /// Root mean square distance to the centroid [m]: turns radians into metres.
  double radius() const { return radius_; }
  /// Root mean square distance to the sensor [m].
  double range() const { return std::hypot(centroid_.norm(), radius_); }
  /// The points to make an estimate from come first; the eighth behind them is for its verification.
  int fitted() const { return size() - size() / 8; }
  /// Size of an even prefix of at least `wanted` points (or all).
  int prefix(int wanted) const;

 private:
  void fill(const Eigen::Matrix3Xf& points);  // the columns order_ lists

  SensorModel sensor_;
  double floor_ = 1.0;
  std::vector<float> x_, y_, z_, weight_;
  std::vector<int> finite_, order_;
  Eigen::Vector3d centroid_ = Eigen::Vector3d::Zero(), view_ = Eigen::Vector3d::Zero();
  double radius_ = 0.0;
};

}  // namespace ttsdf
