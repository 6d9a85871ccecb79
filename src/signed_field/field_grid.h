#pragma once
// The grid that a signed field is sampled on, and what all ways of sampling share.

#include "ttsdf_localization/field/grid_geometry.h"
#include "ttsdf_localization/signed_field/sampled_field.h"
#include "ttsdf_localization/surface/observed_surface.h"

namespace ttsdf {

constexpr int kMaskCellVoxels = 4;

/// Columns: the grid's axes in the map frame, along the dominant planes if there are any, else the map's.
/// `vertex_normals`, if given, stand for the faces' own (a measured surface: they are smoother).
Eigen::Matrix3d gridRotation(const SurfaceMesh& mesh, const Eigen::Matrix3Xf* vertex_normals);
/// From unit normals and areas.
Eigen::Matrix3d gridRotation(const Eigen::Matrix3Xf& normals, const Eigen::VectorXf& areas);

/// Samples from the bounds of `points_map` - margin to their bounds + margin along the axes of `R_map_grid`;
/// without a turn they coincide with the samples voxel_size * integer of the map frame. Throws
/// std::invalid_argument for a grid of more than 2^31 samples or extents that sum up to more than 16000.
GridGeometry gridAround(const Eigen::Matrix3Xf& points_map, const Eigen::Matrix3d& R_map_grid,
                        double voxel_size, double margin);

/// From the map frame [m] to continuous indices.
void toIndexCoordinates(ObservedSurface& surface, const GridGeometry& geometry);

/// How far out exact distances matter under the options' clamping [voxel].
float exactRange(const BuildOptions& options, double voxel_size);

/// Clamped as the options say [m].
float clampedTo(const BuildOptions& options, float metres);

}  // namespace ttsdf
