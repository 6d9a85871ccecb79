#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "parallel.h"
#include "ttsdf_localization/mapping/manhattan_frame.h"
#include "ttsdf_localization/mapping/sampled_field_methods.h"
#include "ttsdf_localization/mapping/signed_distance.h"

namespace ttsdf {
namespace {

Eigen::Matrix3d gridRotation(const ObservedSurface& surface) {
  const SurfaceMesh& mesh = surface.mesh;
  Eigen::Matrix3Xf normals(3, mesh.triangles.cols());
  Eigen::VectorXf areas(mesh.triangles.cols());
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
    const Eigen::Vector3i t = mesh.triangles.col(n);
    const Eigen::Vector3f a = mesh.vertices.col(t[0]);
    areas[n] = (mesh.vertices.col(t[1]) - a).cross(mesh.vertices.col(t[2]) - a).norm();
    normals.col(n) =
        (surface.normals.col(t[0]) + surface.normals.col(t[1]) + surface.normals.col(t[2])).normalized();
  }
  const Eigen::Matrix3d R = manhattanFrame(normals, areas).R_map_frame;
  // A grid that is all but straight stays straight: its samples then coincide with those of the fusion.
  constexpr double kStraight = 5e-4;
  return Eigen::AngleAxisd(R).angle() < kStraight ? Eigen::Matrix3d(Eigen::Matrix3d::Identity()) : R;
}

void toIndexCoordinates(ObservedSurface& surface, const GridGeometry& geometry) {
  const Eigen::Isometry3d T_grid_map = geometry.T_map_grid.inverse();
  const double scale = 1.0 / geometry.voxel_size;
  const Eigen::Matrix3f A = (scale * T_grid_map.linear()).cast<float>();
  const Eigen::Vector3f b = (scale * T_grid_map.translation()).cast<float>();
  surface.mesh.vertices = (A * surface.mesh.vertices).colwise() + b;
  surface.normals = geometry.T_map_grid.linear().transpose().cast<float>() * surface.normals;
}

/// How far out exact distances matter [voxel].
float exactRange(const BuildOptions& options, double voxel_size) {
  if (options.clamp_negative <= 0.0 || options.clamp_positive <= 0.0)
    return std::numeric_limits<float>::max() / 4.0F;
  return static_cast<float>(std::max(options.clamp_negative, options.clamp_positive) / voxel_size) + 1.0F;
}

}  // namespace

GridGeometry gridAround(const Eigen::Matrix3Xf& points_map, const Eigen::Matrix3d& R_map_grid,
                        double voxel_size, double margin) {
  const Eigen::Matrix3Xf local = R_map_grid.transpose().cast<float>() * points_map;
  const Eigen::Array3d low = local.rowwise().minCoeff().cast<double>().array() - margin;
  const Eigen::Array3d high = local.rowwise().maxCoeff().cast<double>().array() + margin;
  const Eigen::Array3d first = (low / voxel_size).floor(), last = (high / voxel_size).ceil();
  GridGeometry geometry;
  geometry.dims = (last - first).cast<int>() + 1;
  geometry.voxel_size = voxel_size;
  geometry.T_map_grid.linear() = R_map_grid;
  geometry.T_map_grid.translation() = R_map_grid * (voxel_size * first).matrix();
  return geometry;
}

SampledField sampleSurfaceDistance(const ObservedGrid& observed, const BuildOptions& options,
                                   const BuildProgress& progress) {
  const ProgressStep surface_step(progress, "surface");
  ObservedSurface surface = observedSurface(observed, kMinSurfacePiece, options.threads);
  if (surface.mesh.empty()) {
    throw std::runtime_error(
        "signed field: got no zero crossing between observed voxels (in pieces of at least " +
        std::to_string(kMinSurfacePiece) + "), wanted an observed surface");
  }
  surface_step.report(0.8);
  const Eigen::Matrix3d R_map_grid = options.align_axes ? gridRotation(surface) : Eigen::Matrix3d::Identity();

  SampledField field;
  field.geometry = gridAround(surface.mesh.vertices, R_map_grid, observed.voxel_size, options.margin);
  toIndexCoordinates(surface, field.geometry);

  const ProgressStep distance_step(progress, "distance");
  NearestSurfaceOptions nearest_options;
  nearest_options.threads = options.threads;
  nearest_options.exact_within = exactRange(options, observed.voxel_size);
  nearest_options.report = [&](double share) { distance_step.report(share); };
  const NearestSurface nearest = nearestSurface(surface.mesh, field.geometry.dims, nearest_options);

  const ProgressStep sign_step(progress, "sign");
  SignedDistanceOptions sign_options;
  sign_options.support_distance = options.support_distance;
  sign_options.clamp_negative = options.clamp_negative;
  sign_options.clamp_positive = options.clamp_positive;
  sign_options.credible_depth = observed.truncation + 1.5 * observed.voxel_size;
  sign_options.threads = options.threads;
  SignedDistance distance = signedDistance(observed, surface, nearest, field.geometry, sign_options);
  sign_step.report(0.6);
  smoothUnknown(distance, observed.voxel_size, options.threads);
  if (options.support_mask)
    field.mask = supportMask(distance.supported, field.geometry.dims, kMaskCellVoxels);
  sign_step.report(1.0);
  field.values = std::move(distance.values);
  field.known = std::move(distance.known);
  return field;
}

}  // namespace ttsdf
