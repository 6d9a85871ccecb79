#include "start_poses.h"

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <limits>

namespace ttsdf {

namespace {

/// Halton sequence, shifted by the seed (Cranley-Patterson rotation).
class Halton {
 public:
  explicit Halton(int seed) {
    std::uint64_t state = 0x9e3779b97f4a7c15ull * (static_cast<std::uint64_t>(seed) + 1);
    for (double& shift : shift_) {
      state ^= state >> 12, state ^= state << 25, state ^= state >> 27;
      shift = static_cast<double>((state * 2685821657736338717ull) >> 11) * 0x1.0p-53;
    }
  }
  double operator()(int n, std::size_t dimension) const {
    static constexpr std::array<int, 6> kBases{{2, 3, 5, 7, 11, 13}};
    const int base = kBases[dimension];
    double value = 0.0, digit = 1.0;
    for (int rest = n + 1; rest > 0; rest /= base) {
      digit /= base;
      value += digit * (rest % base);
    }
    value += shift_[dimension];
    return value - std::floor(value);
  }

 private:
  std::array<double, 6> shift_{};
};

/// Inverse of the normal distribution, by Newton steps on erfc: accurate to
/// 1e-9.
double normalQuantile(double p) {
  const double clipped = std::min(std::max(p, 1e-6), 1.0 - 1e-6);
  double x = 0.0;
  for (int step = 0; step < 60; ++step) {
    const double error = 0.5 * std::erfc(-x / std::sqrt(2.0)) - clipped;
    const double density = std::exp(-0.5 * x * x) / std::sqrt(2.0 * M_PI);
    const double delta = std::max(-0.5, std::min(0.5, error / density));
    x -= delta;
    if (std::abs(delta) < 1e-9) break;
  }
  return x;
}

Eigen::Matrix3d uniformRotation(double a, double b, double c) {
  // Shoemake 1992.
  const double r1 = std::sqrt(1.0 - a), r2 = std::sqrt(a);
  return Eigen::Quaterniond(r2 * std::cos(2 * M_PI * c), r1 * std::sin(2 * M_PI * b),
                            r1 * std::cos(2 * M_PI * b), r2 * std::sin(2 * M_PI * c))
      .toRotationMatrix();
}

}  // namespace

std::vector<Eigen::Isometry3d> startsAround(const Eigen::Isometry3d& T_map_sensor, const Matrix6d& covariance,
                                            int count, int seed) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(covariance);
  const Matrix6d root = solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  const Halton halton(seed);
  std::vector<Eigen::Isometry3d> starts{T_map_sensor};
  for (int n = 0; n + 1 < count; ++n) {
    Vector6d sample;
    for (std::size_t d = 0; d < 6; ++d) sample[static_cast<Eigen::Index>(d)] = normalQuantile(halton(n, d));
    const Vector6d xi = root * sample;
    Eigen::Isometry3d T = T_map_sensor;
    T.linear() = expSo3(xi.head<3>()) * T_map_sensor.linear();
    T.translation() += xi.tail<3>();
    starts.push_back(T);
  }
  return starts;
}

namespace {

constexpr int kBatch = 4096;

/// Positions evenly over the box of a map, and which of them a sensor may be at.
class FreeSpace {
 public:
  FreeSpace(const DistanceField& field, const DistanceField& far, double clearance, const Halton& halton)
      : field_(field), far_(far), clearance_(clearance), halton_(halton) {
    constexpr double kLeastObserved = 0.02;  // of the box: less, and the map does not tell what it has seen
    samplePositions(0);
    if (share() < kLeastObserved) {
      observed_only_ = false;
      samplePositions(0);
    }
  }
  /// Looks at positions [begin, begin + kBatch) of the sequence.
  void samplePositions(int begin) {
    const GridGeometry& geometry = field_.geometry();
    const Eigen::Vector3d extent = (geometry.dims - 1).cast<double>();
    for (int n = 0; n < kBatch; ++n) {
      const Eigen::Vector3d unit(halton_(begin + n, 0), halton_(begin + n, 1), halton_(begin + n, 2));
      positions_.col(n) = geometry.samplePosition(unit.cwiseProduct(extent)).cast<float>();
    }
    samples_ = field_.evaluate(positions_), distances_ = far_.evaluate(positions_);
  }
  bool isFree(int n) const {
    const auto at = static_cast<std::size_t>(n);
    const PointState state = samples_.states[at];
    return (observed_only_ ? state == PointState::kValid : state != PointState::kOutside) &&
           distances_.states[at] != PointState::kOutside && distances_.values[n] >= clearance_;
  }
  Eigen::Vector3d position(int n) const { return positions_.col(n).cast<double>(); }
  double share() const {
    int count = 0;
    for (int n = 0; n < kBatch; ++n) count += isFree(n) ? 1 : 0;
    return static_cast<double>(count) / kBatch;
  }

 private:
  const DistanceField &field_, &far_;
  double clearance_;
  const Halton& halton_;
  bool observed_only_ = true;
  Eigen::Matrix3Xf positions_{3, kBatch};
  FieldSamples samples_, distances_;
};

}  // namespace

double freeVolume(const DistanceField& field, const DistanceField& far, double clearance, int seed) {
  const Halton halton(seed);
  const GridGeometry& geometry = field.geometry();
  return FreeSpace(field, far, clearance, halton).share() *
         (geometry.voxel_size * (geometry.dims - 1).cast<double>()).prod();
}

std::vector<Eigen::Isometry3d> startsOverMap(const DistanceField& field, const DistanceField& far,
                                             const std::optional<GravityHint>& gravity, double clearance,
                                             int count, int seed) {
  const Halton halton(seed);
  FreeSpace space(field, far, clearance, halton);
  std::vector<Eigen::Isometry3d> starts;
  const int most = std::min(count, std::numeric_limits<int>::max() / 128) * 64;  // positions looked at
  for (int begin = 0; begin < most && static_cast<int>(starts.size()) < count; begin += kBatch) {
    if (begin > 0) space.samplePositions(begin);
    for (int n = 0; n < kBatch && static_cast<int>(starts.size()) < count; ++n) {
      if (!space.isFree(n)) continue;
      const double a = halton(begin + n, 3), b = halton(begin + n, 4), c = halton(begin + n, 5);
      Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
      T.translation() = space.position(n);
      if (gravity) {
        const double tilt = gravity->tilt_sigma * std::sqrt(-2.0 * std::log(1.0 - 0.999 * b));
        const Eigen::Vector3d axis_seed = gravity->down_map.unitOrthogonal();
        const Eigen::Matrix3d lean(Eigen::AngleAxisd(2 * M_PI * c, gravity->down_map));
        T.linear() =
            Eigen::AngleAxisd(0.7 * tilt, lean * axis_seed).toRotationMatrix() *
            Eigen::AngleAxisd(2 * M_PI * a, gravity->down_map).toRotationMatrix() *
            Eigen::Quaterniond::FromTwoVectors(gravity->down_sensor, gravity->down_map).toRotationMatrix();
      } else {
        T.linear() = uniformRotation(a, b, c);
      }
      starts.push_back(T);
    }
  }
  return starts;
}

}  // namespace ttsdf
