#include "scan_buffer.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace ttsdf {

namespace {
constexpr int kLevels = 8;                                 // finest sub-sample: every 8th point
constexpr int kPhase[kLevels] = {0, 4, 2, 6, 1, 5, 3, 7};  // bit-reversed: prefixes stay even
constexpr float kFarthest = 1e4f;                          // [m]; beyond is a sensor fault, not a point
}  // namespace

void ScanBuffer::assign(const Eigen::Matrix3Xf& points, int max_points) {
  finite_.clear();
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    if ((points.col(n).array().abs() < kFarthest).all())
      finite_.push_back(static_cast<int>(n));  // false for NaN
  }
  const int available = static_cast<int>(finite_.size());
  const int count = std::min(available, std::max(1, max_points));
  order_.clear();
  for (const int phase : kPhase) {
    for (int n = phase; n < count; n += kLevels) {
      order_.push_back(finite_[static_cast<std::size_t>(static_cast<long>(n) * available / count)]);
    }
  }
  fill(points);
}

void ScanBuffer::fill(const Eigen::Matrix3Xf& points) {
  centroid_.setZero(), view_.setZero();
  for (const int n : order_) centroid_ += points.col(n).cast<double>();
  if (!order_.empty()) centroid_ /= static_cast<double>(order_.size());
  x_.resize(order_.size()), y_.resize(order_.size()), z_.resize(order_.size());
  weight_.resize(order_.size());
  double sum = 0.0;
  for (std::size_t n = 0; n < order_.size(); ++n) {
    const Eigen::Vector3d p = points.col(order_[n]).cast<double>() - centroid_;
    x_[n] = static_cast<float>(p.x()), y_[n] = static_cast<float>(p.y()), z_[n] = static_cast<float>(p.z());
    const Eigen::Vector3d from_sensor = points.col(order_[n]).cast<double>();
    const double range = from_sensor.norm();
    if (range > 0.0) view_ += from_sensor / range;
    weight_[n] = static_cast<float>(sensor_.weight(range, floor_));
    sum += p.squaredNorm();
  }
  if (!order_.empty()) view_ /= static_cast<double>(order_.size());
  radius_ = order_.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(order_.size()));
}

void ScanBuffer::assign(const ScanBuffer& scan, int wanted) {
  sensor_ = scan.sensor_, floor_ = scan.floor_;
  const int count = scan.prefix(wanted);
  Eigen::Matrix3Xf points(3, count);
  const Eigen::Vector3f c = scan.centroid().cast<float>();
  for (int n = 0; n < count; ++n) points.col(n) = c + Eigen::Vector3f(scan.x()[n], scan.y()[n], scan.z()[n]);
  order_.resize(static_cast<std::size_t>(count));
  std::iota(order_.begin(), order_.end(), 0);
  fill(points);
}

int ScanBuffer::prefix(int wanted) const {
  for (int level = 1; level < kLevels; level *= 2) {
    const int count = (size() * level + kLevels - 1) / kLevels;
    if (count >= wanted) return count;
  }
  return size();
}

}  // namespace ttsdf
