#pragma once
// Fusion of depth into an OpenVDB truncated signed distance volume with weights and free-space carving.
// Sample (i, j, k) sits at voxel_size * (i, j, k) of the map frame, and the grids' transforms say the same.

#include <memory>
#include <string>

#include <Eigen/Geometry>

#include "ttsdf_localization/mapping/depth_image.h"
#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

struct FusionOptions {
  double voxel_size = 0.02;       ///< [m]
  double truncation = 0.06;       ///< [m]
  double min_depth = 0.2;         ///< [m]
  double max_depth = 4.0;         ///< [m]
  bool carve = true;              ///< mark what rays crossed as free
  int threads = 2;
};
const OptionTable<FusionOptions>& fusionOptionTable();

class TsdfVolume {
 public:
  explicit TsdfVolume(FusionOptions options = {});
  ~TsdfVolume();
  TsdfVolume(TsdfVolume&&) noexcept;
  TsdfVolume& operator=(TsdfVolume&&) noexcept;

  /// Projective fusion of one depth image. Throws std::invalid_argument for a pose that is not finite or an image
  /// that does not fit its intrinsics.
  void integrate(const DepthImage& image, const CameraIntrinsics& intrinsics, const Eigen::Isometry3d& T_map_camera);
  /// Any cloud, ray by ray from the sensor's origin. Points in the sensor frame; non-finite ones and those out of
  /// range are skipped.
  void integrate(const Eigen::Matrix3Xf& points, const Eigen::Isometry3d& T_map_sensor);
  /// A level set or TSDF grid made by others (first float grid of the file). Throws std::runtime_error.
  static TsdfVolume fromVdbFile(const std::string& path, FusionOptions options);

  /// Writes grids "tsdf", "weight" and "free". Throws std::runtime_error.
  void saveVdb(const std::string& path) const;

  const FusionOptions& options() const;
  std::size_t frameCount() const;
  bool empty() const;  ///< no surface observed
  std::size_t memoryBytes() const;

  /// OpenVDB side, for the other files of mapping/ only (declared in tsdf_volume_grids.h).
  struct Grids;
  const Grids& grids() const;
  Grids& grids();

 private:
  std::unique_ptr<Grids> grids_;
  FusionOptions options_;
};

}  // namespace ttsdf
