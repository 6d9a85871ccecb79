#include "ttsdf_localization/agreement/frame_comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "ttsdf_localization/registration/registration.h"
#include "volume_field.h"

namespace ttsdf {

namespace {

constexpr int kPixelStride = 4;         // of images
constexpr int kPoints = 1500;           // of a frame kept for comparison
constexpr std::size_t kMostKept = 120;  // frames; more, and every third of them stays
/// Frames from nearly the same place share what their poses have wrong, so they go into the same volume.
constexpr double kSamePlace = 0.03, kSameDirection = 0.03;  // [m, rad]
/// Of the map's voxels: an eighth of the samples.
constexpr double kVoxels = 2.0;
constexpr double kBandVoxels = 3.0;

FusionOptions coarse(FusionOptions fusion) {
  fusion.voxel_size *= kVoxels;
  fusion.truncation = std::max(fusion.truncation, kBandVoxels * fusion.voxel_size);
  fusion.carve = false;
  return fusion;
}

/// At most kPoints of those in range, evenly.
Eigen::Matrix3Xf thinned(const Eigen::Matrix3Xf& points, const FusionOptions& fusion) {
  std::vector<Eigen::Index> usable;
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    const double range = points.col(n).cast<double>().norm();
    if (range >= fusion.min_depth && range <= fusion.max_depth) usable.push_back(n);
  }
  const auto count = std::min<std::size_t>(usable.size(), kPoints);
  Eigen::Matrix3Xf result(3, static_cast<Eigen::Index>(count));
  for (std::size_t n = 0; n < count; ++n) {
    result.col(static_cast<Eigen::Index>(n)) = points.col(usable[n * usable.size() / count]);
  }
  return result;
}

/// From the recorded pose, within the band: the volume has no far field to look beyond it.
RegistrationOptions nearOnly(const TsdfVolume& volume) {
  RegistrationOptions options;
  options.sensor = volume.options().sensor;
  options.long_range = false;
  options.restarts = 0;
  options.min_confidence = 0.0;  // the band is all that is known here: much of a frame lies outside of it
  options.max_points = kPoints;
  return options;
}

FrameDifference compareWith(Registration& registration, const Eigen::Matrix3Xf& points,
                            const Eigen::Isometry3d& T_map_sensor) {
  FrameDifference difference;
  difference.viewpoint = viewpointOf(points, T_map_sensor);
  const RegistrationResult result = registration.align(points, T_map_sensor);
  difference.overlap = 1.0 - result.outside_ratio - result.unknown_ratio;
  switch (result.reason) {
    case TerminationReason::kTooFewPoints:
    case TerminationReason::kOutsideMap:
    case TerminationReason::kDegenerate:
      return difference;
    default:
      difference.outcome =
          result.success ? FrameDifference::Outcome::kCompared : FrameDifference::Outcome::kContradicts;
  }
  if (!result.success) return difference;
  const Eigen::Matrix3d to_sensor = T_map_sensor.linear().transpose();
  difference.step << logSo3(to_sensor * result.T_map_sensor.linear()),
      to_sensor * (result.T_map_sensor.translation() - T_map_sensor.translation());
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = to_sensor;
  difference.covariance = turn * result.covariance * turn.transpose();
  if (points.cols() > 0) difference.centroid = points.cast<double>().rowwise().mean();
  return difference;
}

}  // namespace

FrameDifference compareFrame(const TsdfVolume& others, const Eigen::Matrix3Xf& points,
                             const Eigen::Isometry3d& T_map_sensor) {
  if (others.empty()) return {};
  Registration registration(std::make_shared<VolumeField>(others), nearOnly(others));
  return compareWith(registration, points, T_map_sensor);
}

struct FrameComparison::Parts {
  struct Kept {
    std::size_t frame;
    int part;
    Eigen::Matrix3Xf points;
    Eigen::Isometry3d T_map_sensor;
  };

  explicit Parts(const FusionOptions& options)
      : fusion(options), volumes{{TsdfVolume(coarse(options)), TsdfVolume(coarse(options))}} {}

  /// The volume of the next frame.
  int choose(const Eigen::Isometry3d& T_map_sensor) {
    if (frames > 0) {
      const PoseError moved = poseError(T_turned, T_map_sensor);
      if (moved.translation < kSamePlace && moved.rotation < kSameDirection) return part;
      part = 1 - part;
    }
    T_turned = T_map_sensor;
    return part;
  }

  bool wanted() const { return frames % stride == 0; }
  void keep(const Eigen::Matrix3Xf& points, const Eigen::Isometry3d& T_map_sensor) {
    kept.push_back({frames, part, thinned(points, fusion), T_map_sensor});
    if (kept.size() <= kMostKept) return;
    stride *= 3;  // an odd factor: frames of both volumes stay
    kept.erase(
        std::remove_if(kept.begin(), kept.end(), [this](const Kept& k) { return k.frame % stride != 0; }),
        kept.end());
  }

  FusionOptions fusion;
  std::array<TsdfVolume, 2> volumes;
  std::vector<Kept> kept;
  std::size_t frames = 0, stride = 1;
  int part = 0;
  Eigen::Isometry3d T_turned = Eigen::Isometry3d::Identity();  // where the volume last changed
};

FrameComparison::FrameComparison(const FusionOptions& fusion) : parts_(std::make_unique<Parts>(fusion)) {}
FrameComparison::~FrameComparison() = default;
FrameComparison::FrameComparison(FrameComparison&&) noexcept = default;
FrameComparison& FrameComparison::operator=(FrameComparison&&) noexcept = default;

void FrameComparison::add(const DepthImage& image, const CameraIntrinsics& intrinsics,
                          const Eigen::Isometry3d& T_map_camera) {
  checkFits(image, intrinsics);
  // As a cloud: an image of a cluttered place leaves holes behind its edges, and few cells would be whole.
  const FusionOptions& fusion = parts_->fusion;
  add(toPoints(image, intrinsics, kPixelStride, fusion.min_depth, fusion.max_depth), T_map_camera);
}

void FrameComparison::add(const Eigen::Matrix3Xf& points, const Eigen::Isometry3d& T_map_sensor) {
  Parts& p = *parts_;
  p.volumes[static_cast<std::size_t>(p.choose(T_map_sensor))].integrate(points, T_map_sensor);
  if (p.wanted()) p.keep(points, T_map_sensor);
  ++p.frames;
}

std::size_t FrameComparison::frameCount() const { return parts_->frames; }

std::vector<FrameDifference> FrameComparison::compare() const {
  std::array<std::optional<Registration>, 2> against;  // the volume that holds the others, by the frame's own
  for (std::size_t part = 0; part < 2; ++part) {
    const TsdfVolume& others = parts_->volumes[1 - part];
    if (!others.empty()) against[part].emplace(std::make_shared<VolumeField>(others), nearOnly(others));
  }
  std::vector<FrameDifference> differences;
  for (const Parts::Kept& kept : parts_->kept) {
    auto& registration = against[static_cast<std::size_t>(kept.part)];
    if (!registration) continue;
    differences.push_back(compareWith(*registration, kept.points, kept.T_map_sensor));
    differences.back().frame = kept.frame;
  }
  return differences;
}

}  // namespace ttsdf
