#include "ttsdf_localization/surface/manhattan_frame.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace ttsdf {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr double kMinShare = 0.25;

/// Directions without sign on the three faces of half a cube.
class DirectionHistogram {
 public:
  DirectionHistogram() : weight_(3 * kSide * kSide, 0.0), sum_(weight_.size(), Eigen::Vector3d::Zero()) {}

  void add(const Eigen::Vector3d& n, double weight) {
    int face = 0;
    n.cwiseAbs().maxCoeff(&face);
    const Eigen::Vector3d folded = n[face] < 0.0 ? Eigen::Vector3d(-n) : n;
    const auto bin = [&](int axis) {
      return std::min(kSide - 1, static_cast<int>((folded[axis] / folded[face] + 1.0) * 0.5 * kSide));
    };
    const auto index =
        static_cast<std::size_t>((face * kSide + bin((face + 1) % 3)) * kSide + bin((face + 2) % 3));
    weight_[index] += weight;
    sum_[index] += weight * folded;
  }

  /// Mean directions around the heaviest bins, at least 15 degrees apart.
  std::vector<Eigen::Vector3d> peaks(std::size_t count) const {
    std::vector<std::size_t> order(weight_.size());
    for (std::size_t n = 0; n < order.size(); ++n) order[n] = n;
    std::stable_sort(order.begin(), order.end(),
                     [this](std::size_t a, std::size_t b) { return weight_[a] > weight_[b]; });
    std::vector<Eigen::Vector3d> found;
    for (const std::size_t bin : order) {
      if (found.size() == count || weight_[bin] <= 0.0) break;
      const Eigen::Vector3d direction = sum_[bin].normalized();
      const bool is_new = std::all_of(found.begin(), found.end(), [&](const Eigen::Vector3d& other) {
        return std::abs(other.dot(direction)) < std::cos(15.0 * kDegree);
      });
      if (is_new) found.push_back(direction);
    }
    return found;
  }

 private:
  static constexpr int kSide = 32;  // bins of 2 to 4 degrees
  std::vector<double> weight_;
  std::vector<Eigen::Vector3d> sum_;
};

class FrameSearch {
 public:
  FrameSearch(const Eigen::Matrix3Xf& normals, const Eigen::VectorXf& areas) {
    // The mode of a few ten thousand normals is the mode of them all.
    const Eigen::Index stride = std::max<Eigen::Index>(1, normals.cols() / 40000);
    for (Eigen::Index n = 0; n < normals.cols(); n += stride) {
      const Eigen::Vector3d normal = normals.col(n).cast<double>();
      const double length = normal.norm(), weight = areas[n];
      if (!(length > 0.5) || !(weight > 0.0)) continue;
      normals_.push_back(normal / length);
      weights_.push_back(weight);
      total_ += weight;
    }
    if (!(total_ > 0.0))
      throw std::invalid_argument("Manhattan frame: got no normal with an area, wanted at least one");
  }

  ManhattanFrame run() const {
    DirectionHistogram histogram;
    for (std::size_t n = 0; n < normals_.size(); ++n) histogram.add(normals_[n], weights_[n]);
    ManhattanFrame best;
    for (const auto& peak : histogram.peaks(5)) {
      Eigen::Matrix3d R = frameAbout(peak);
      R = refined(refined(R, 10.0 * kDegree), 5.0 * kDegree);
      const double spread = medianAngle(R, 10.0 * kDegree);
      for (int step = 0; step < 6; ++step) R = refined(R, std::max(1.5 * kDegree, spread));
      const double share = shareWithin(R, 10.0 * kDegree);
      if (share > best.share) best = {R, share};
    }
    if (best.share < kMinShare) return {Eigen::Matrix3d::Identity(), best.share};
    best.R_map_frame = turnedLeast(best.R_map_frame);
    return best;
  }

 private:
  /// The peak and the mode of the other normals' angle about it, modulo a right angle.
  Eigen::Matrix3d frameAbout(const Eigen::Vector3d& peak) const {
    Eigen::Matrix3d R = basis(peak);
    constexpr int kBins = 90;
    std::array<double, kBins> histogram{};
    double sum = 0.0;
    for (std::size_t n = 0; n < normals_.size(); ++n) {
      if (std::abs(normals_[n].dot(peak)) > std::sin(15.0 * kDegree)) continue;
      const double angle = std::atan2(normals_[n].dot(R.col(1)), normals_[n].dot(R.col(0))) / kDegree + 360.0;
      histogram[static_cast<std::size_t>(angle) % kBins] += weights_[n];
      sum += weights_[n];
    }
    if (sum < 0.02 * total_) return R;  // nothing to turn by
    std::size_t mode = 0;
    double most = -1.0;
    for (std::size_t b = 0; b < kBins; ++b) {
      const double weight =
          histogram[(b + kBins - 1) % kBins] + 2.0 * histogram[b] + histogram[(b + 1) % kBins];
      if (weight > most) most = weight, mode = b;
    }
    return R * Eigen::AngleAxisd((static_cast<double>(mode) + 0.5) * kDegree, Eigen::Vector3d::UnitZ())
                   .toRotationMatrix();
  }

  /// Frame with `axis` as third column, turned as little as possible from the map's axes.
  static Eigen::Matrix3d basis(const Eigen::Vector3d& axis) {
    int nearest = 0;
    axis.cwiseAbs().maxCoeff(&nearest);
    const Eigen::Vector3d from = std::copysign(1.0, axis[nearest]) * Eigen::Vector3d::Unit(nearest);
    const Eigen::Matrix3d turn = Eigen::Quaterniond::FromTwoVectors(from, axis).toRotationMatrix();
    Eigen::Matrix3d R;
    R << turn * Eigen::Vector3d::Unit((nearest + 1) % 3), turn * Eigen::Vector3d::Unit((nearest + 2) % 3),
        turn * Eigen::Vector3d::Unit(nearest);
    return R;
  }

  /// One step of iteratively reweighted least squares: the rotation that brings the axes closest to the
  /// normals nearest to them (Kabsch), with Geman-McClure weights on the angle.
  Eigen::Matrix3d refined(const Eigen::Matrix3d& R, double scale) const {
    Eigen::Matrix3d correlation = 1e-9 * total_ * R;
    for (std::size_t n = 0; n < normals_.size(); ++n) {
      const Eigen::Vector3d local = R.transpose() * normals_[n];
      int axis = 0;
      const double cosine = local.cwiseAbs().maxCoeff(&axis);
      const double angle = std::acos(std::min(1.0, cosine));
      if (angle > 3.0 * scale) continue;
      const double ratio = 1.0 + angle * angle / (scale * scale);
      correlation.col(axis) += weights_[n] / (ratio * ratio) * std::copysign(1.0, local[axis]) * normals_[n];
    }
    // An axis without normals must not be turned freely: the other two and the cross product fix it.
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d D = Eigen::Matrix3d::Identity();
    D(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    return svd.matrixU() * D * svd.matrixV().transpose();
  }

  /// Median angle to the nearest axis of the normals within `limit` of one: how noisy they are.
  double medianAngle(const Eigen::Matrix3d& R, double limit) const {
    std::vector<double> angles;
    for (const auto& normal : normals_) {
      const double angle = std::acos(std::min(1.0, (R.transpose() * normal).cwiseAbs().maxCoeff()));
      if (angle < limit) angles.push_back(angle);
    }
    if (angles.empty()) return limit;
    const auto middle = angles.begin() + static_cast<std::ptrdiff_t>(angles.size() / 2);
    std::nth_element(angles.begin(), middle, angles.end());
    return *middle;
  }

  double shareWithin(const Eigen::Matrix3d& R, double angle) const {
    const double cosine = std::cos(angle);
    double sum = 0.0;
    for (std::size_t n = 0; n < normals_.size(); ++n) {
      if ((R.transpose() * normals_[n]).cwiseAbs().maxCoeff() > cosine) sum += weights_[n];
    }
    return sum / total_;
  }

  static Eigen::Matrix3d turnedLeast(const Eigen::Matrix3d& R) {
    Eigen::Matrix3d best = R;
    double largest = -4.0;
    std::array<int, 3> order{0, 1, 2};
    do {
      for (int signs = 0; signs < 8; ++signs) {
        Eigen::Matrix3d candidate;
        for (int c = 0; c < 3; ++c)
          candidate.col(c) = ((signs >> c) & 1 ? -1.0 : 1.0) * R.col(order[static_cast<std::size_t>(c)]);
        if (candidate.determinant() > 0.0 && candidate.trace() > largest)
          largest = candidate.trace(), best = candidate;
      }
    } while (std::next_permutation(order.begin(), order.end()));
    return best;
  }

  std::vector<Eigen::Vector3d> normals_;
  std::vector<double> weights_;
  double total_ = 0.0;
};

}  // namespace

ManhattanFrame manhattanFrame(const Eigen::Matrix3Xf& normals, const Eigen::VectorXf& areas) {
  if (normals.cols() != areas.size()) {
    std::ostringstream text;
    text << "Manhattan frame: got " << normals.cols() << " normals and " << areas.size()
         << " areas, wanted as many";
    throw std::invalid_argument(text.str());
  }
  return FrameSearch(normals, areas).run();
}

}  // namespace ttsdf
