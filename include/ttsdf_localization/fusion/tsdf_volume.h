#pragma once
// Fusion of depth into an OpenVDB truncated signed distance volume with weights and free-space carving.
// Sample (i, j, k) sits at voxel_size * (i, j, k) of the map frame, and the grids' transforms say the same.
//
// Memory: 4.3 kB per 8^3 block that holds surface band, up to 0.1 kB per block that is partly free, 8 bytes
// per block that is wholly free. A room at 2 cm takes 15 to 50 MB. Time: grows with the image and with the
// surface it shows, not with the free space in front of it.

#include <Eigen/Geometry>
#include <cstddef>
#include <memory>
#include <string>

#include "ttsdf_localization/files/file_writer.h"
#include "ttsdf_localization/frames/depth_image.h"
#include "ttsdf_localization/options/option_table.h"

namespace ttsdf {

struct FusionOptions {
  double voxel_size = 0.02;       ///< [m]
  double truncation = 0.06;       ///< [m]; at least voxel_size
  double min_depth = 0.2;         ///< [m]
  double max_depth = 4.0;         ///< [m]; readings beyond carve free space up to here and add no surface
  double max_weight = 100.0;      ///< cap of a voxel's weight: later frames then count as a moving average
  bool carve = true;              ///< mark what rays crossed as free
  std::string sensor = "kinect";  ///< how readings are weighed (sensor/sensor_model.h)
  int threads = 2;
  /// What a reading is off by beside its sensor's noise [m]: a volume shows a part of a voxel, not less.
  double readingFloor() const { return 0.25 * voxel_size; }
};
const OptionTable<FusionOptions>& fusionOptionTable();

/// Of every .vdb file; saveVdb replaces nothing else.
extern const FileKind kVdbFile;

/// What of a .vdb file is read.
struct VdbImport {
  std::string grid;    ///< name of the grid; empty: the only one of real numbers, or the only level set
  double scale = 1.0;  ///< metres per unit of the file
  std::string* note = nullptr;  ///< receives which grid was taken where there was a choice; may be null
};

/// Not thread-safe; each call uses `threads` threads itself. Results do not depend on their number.
class TsdfVolume {
 public:
  /// Throws std::invalid_argument for an option out of range.
  explicit TsdfVolume(FusionOptions options = {});
  ~TsdfVolume();
  TsdfVolume(TsdfVolume&&) noexcept;
  TsdfVolume& operator=(TsdfVolume&&) noexcept;

  /// Projective fusion of one depth image. Throws std::invalid_argument for a pose that is not finite or an
  /// image that does not fit its intrinsics.
  void integrate(const DepthImage& image, const CameraIntrinsics& intrinsics,
                 const Eigen::Isometry3d& T_map_camera);
  /// Any cloud, ray by ray from the sensor's origin. Points in the sensor frame; non-finite ones and those
  /// whose range is outside [min_depth, max_depth] are skipped. Throws std::invalid_argument for a pose that
  /// is not finite.
  void integrate(const Eigen::Matrix3Xf& points, const Eigen::Isometry3d& T_map_sensor);

  /// A level set or TSDF grid made by others, read in a process of its own and resampled to
  /// `options.voxel_size`, or a file written by saveVdb, restored exactly (voxel size and truncation then
  /// come from the file). A closed level set also says what is inside and outside; in an open one, voxels
  /// that are not active are unknown. The truncation shrinks to the file's band where that is narrower.
  /// Throws std::runtime_error: no such file, not a VDB file or a damaged one, no grid of real numbers or
  /// several, an empty one, a transform that is not linear, extents that cannot be built, or a band thinner
  /// than a voxel.
  static TsdfVolume fromVdbFile(const std::string& path, FusionOptions options, const VdbImport& source = {});

  /// Writes grids "tsdf", "weight" and "free", as files/file_writer.h has it. Throws std::runtime_error.
  void saveVdb(const std::string& path) const;

  const FusionOptions& options() const;
  /// Where the grids' coordinates begin, in the map frame [m]: zero near the map's origin; elsewhere (UTM)
  /// whole metres near the first scan, so that single precision will do.
  const Eigen::Vector3d& origin() const { return origin_; }
  void setOrigin(const Eigen::Vector3d& origin) { origin_ = origin; }
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
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();

  Eigen::Isometry3d relativeToOrigin(const Eigen::Isometry3d& T_map_sensor);
};

}  // namespace ttsdf
