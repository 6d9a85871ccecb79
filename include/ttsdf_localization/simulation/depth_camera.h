#pragma once
// A depth camera that renders an analytic scene: exact depth along the optical axis, then, if wanted, a
// sensor's noise.

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "ttsdf_localization/frames/depth_image.h"
#include "ttsdf_localization/options/option_table.h"
#include "ttsdf_localization/simulation/analytic_scene.h"
#include "ttsdf_localization/simulation/depth_noise.h"

namespace ttsdf {

struct RowBuffer;
struct VisibleSolid;

struct DepthCameraOptions {
  int width = 640, height = 480;
  double fx = 525.0, fy = 525.0;  ///< focal lengths [pixel]
  double min_range = 0.3;         ///< readings outside [min_range, max_range] are holes [m]
  double max_range = 5.0;
  int threads = 1;
  DepthNoiseOptions noise;  ///< default: none, exact depth
};
const OptionTable<DepthCameraOptions>& depthCameraOptionTable();

class DepthCamera {
 public:
  /// The principal point is the image centre. Throws std::invalid_argument for bad options.
  explicit DepthCamera(const DepthCameraOptions& options = {});

  const DepthCameraOptions& options() const { return options_; }
  const CameraIntrinsics& intrinsics() const { return intrinsics_; }

  /// Image of scene and clutter from an optical frame (z forward, x right, y down). Equal arguments, equal
  /// image, whatever the number of threads; `frame` chooses the noise. Nothing nearer than 1 mm to the image
  /// plane is seen. Thread-safe. Throws std::invalid_argument for a pose that is not finite.
  DepthImage render(const AnalyticScene& scene, const Eigen::Isometry3d& T_map_camera,
                    std::uint64_t frame = 0, const std::vector<Solid>& clutter = {}) const;

 private:
  /// Exact depths of a row -> the sensor's readings.
  void readRow(const std::vector<VisibleSolid>& visible, const RowBuffer& row, int v, std::uint64_t frame,
               DepthImage& image) const;

  DepthCameraOptions options_;
  CameraIntrinsics intrinsics_;
};

}  // namespace ttsdf
