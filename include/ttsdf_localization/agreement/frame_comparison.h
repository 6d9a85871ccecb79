#pragma once
// Do the frames of a map agree with each other? Frames go into two coarse volumes by turns, and some of them
// are registered against the volume that does not contain them: how far the answer lies from the pose they
// came with is how far a map made of them contradicts a frame that is not in it.
//
// Cost: one fusion at twice the voxel size per frame, and 5 to 20 ms for each frame compared.
// Memory: the two volumes, and about 18 kB for each frame kept for comparison.

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ttsdf_localization/field/frame_agreement.h"
#include "ttsdf_localization/fusion/tsdf_volume.h"
#include "ttsdf_localization/geometry/se3.h"

namespace ttsdf {

/// What one frame says about its recorded pose.
struct FrameDifference {
  enum class Outcome {
    kCompared,     ///< `step` is how far the pose is off
    kNoOverlap,    ///< too few of its points lie where the other frames saw a surface
    kContradicts,  ///< it overlaps, but fits nowhere near its pose: off by more than the band is wide, or
                   ///< distorted
  };
  std::size_t frame = 0;  ///< in the order they were added
  Outcome outcome = Outcome::kNoOverlap;
  /// From the recorded pose to the registered one: [rotation; translation] about the sensor's position, in
  /// the sensor's axes [rad, m].
  Vector6d step = Vector6d::Zero();
  /// What the registration alone cannot tell: covariance of the step as the scan says it.
  Matrix6d covariance = Matrix6d::Zero();
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< of the frame's points, sensor frame [m]
  Viewpoint viewpoint;                                 ///< it was recorded from
  double overlap = 0.0;  ///< share of its points where the other frames know something
  double translation() const { return step.tail<3>().norm(); }  ///< [m]
  double rotation() const { return step.head<3>().norm(); }     ///< [rad]
};

/// One frame against a volume that does not contain it. `points` in the sensor frame.
FrameDifference compareFrame(const TsdfVolume& others, const Eigen::Matrix3Xf& points,
                             const Eigen::Isometry3d& T_map_sensor);

/// Takes all frames of a map in their order and compares some of them, evenly spread. Not thread-safe.
class FrameComparison {
 public:
  /// `fusion`: of the map. Throws std::invalid_argument for an option out of range.
  explicit FrameComparison(const FusionOptions& fusion);
  ~FrameComparison();
  FrameComparison(FrameComparison&&) noexcept;
  FrameComparison& operator=(FrameComparison&&) noexcept;

  /// As TsdfVolume::integrate; throw what it throws.
  void add(const DepthImage& image, const CameraIntrinsics& intrinsics,
           const Eigen::Isometry3d& T_map_camera);
  void add(const Eigen::Matrix3Xf& points, const Eigen::Isometry3d& T_map_sensor);

  std::size_t frameCount() const;
  /// Differences of the frames kept so far, rising index; empty with fewer than two frames.
  std::vector<FrameDifference> compare() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// What is kept of them in the map. Sizes are chosen so that the differences are as likely as they can be,
/// given what each registration could not tell, with rare large ones expected. Frames from one viewpoint
/// are then summed up, because poses are off by whole stretches of a sequence; at last all sizes are widened
/// until frames, each at the variance that the others predict there, lie no further out than normal ones.
/// `voxel_size`: of the map [m], positive.
FrameAgreement summarize(const std::vector<FrameDifference>& differences, double voxel_size);

}  // namespace ttsdf
