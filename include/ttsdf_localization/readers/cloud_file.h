#pragma once
// Points as cloud files hold them, in double precision.

#include <Eigen/Geometry>
#include <optional>
#include <string>

namespace ttsdf {

struct CloudFile {
  Eigen::Matrix3Xd points;   ///< in the file's units; "no reading" (NaN, infinity) included
  Eigen::Matrix3Xf normals;  ///< as the file has them; without columns if it has none
  /// Where the sensor stood in the points' frame, for files that say so (VIEWPOINT of a PCD other than the
  /// identity).
  std::optional<Eigen::Isometry3d> T_points_sensor;
  bool whole_numbers =
      false;  ///< the file holds integers: their unit is anybody's guess (mostly millimetres)
};

/// Reads .pcd (ascii, binary, binary_compressed), .ply, .xyz / .txt / .pts / .asc / .csv (x y z and more in a
/// line) and .bin (x y z as float32 or float64, told apart by what the values would be). Throws
/// std::runtime_error naming the file and the place: unreadable, truncated, counts that disagree with the
/// data, no x y z.
CloudFile readCloudFile(const std::string& path);

/// Of a scan, in the sensor's frame: as readCloudFile, but integers are refused.
Eigen::Matrix3Xf readScanFile(const std::string& path);

}  // namespace ttsdf
