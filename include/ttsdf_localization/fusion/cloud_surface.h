#pragma once
// A volume from points of surfaces: scans that are merged already, meshes' vertices, occupied cells. Nothing
// is known of the rays; the points' normals say on which side the free space is.

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "ttsdf_localization/build_steps/build_options.h"
#include "ttsdf_localization/fusion/tsdf_volume.h"

namespace ttsdf {

struct OrientedCloud {
  Eigen::Matrix3Xd points;                   ///< map frame [m]; columns that are not finite are left out
  Eigen::Matrix3Xf normals;                  ///< towards free space, any length; no columns: estimated
  std::optional<Eigen::Vector3d> viewpoint;  ///< that normals are turned to; used where there are none
  bool seen_from_inside = true;  ///< without viewpoint: free space is inside (rooms) or outside (objects)
};

/// What was found about a cloud.
struct CloudReport {
  std::size_t points = 0;  ///< finite ones
  double spacing =
      0.0;  ///< median distance to the nearest neighbour, after thinning to a point per voxel [m]
  bool normals_estimated = false;
  std::string outliers;  ///< describeOutliers; empty: none
};

/// Distances to the points' tangent planes in the band, free space in front of it. Points further apart than
/// three voxels leave holes. Throws std::invalid_argument: fewer than 50 finite points, sizes that do not
/// match, extents that cannot be built.
TsdfVolume volumeFromCloud(const OrientedCloud& cloud, const FusionOptions& options,
                           CloudReport* report = nullptr, const BuildProgress& progress = {});

}  // namespace ttsdf
