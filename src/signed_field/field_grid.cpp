#include "field_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "ttsdf_localization/surface/manhattan_frame.h"

namespace ttsdf {

Eigen::Matrix3d gridRotation(const SurfaceMesh& mesh, const Eigen::Matrix3Xf* vertex_normals) {
  Eigen::Matrix3Xf normals(3, mesh.triangles.cols());
  Eigen::VectorXf areas(mesh.triangles.cols());
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
    const Eigen::Vector3i t = mesh.triangles.col(n);
    const Eigen::Vector3f a = mesh.vertices.col(t[0]);
    Eigen::Vector3f normal = (mesh.vertices.col(t[1]) - a).cross(mesh.vertices.col(t[2]) - a);
    areas[n] = normal.norm();
    if (vertex_normals)
      normal = vertex_normals->col(t[0]) + vertex_normals->col(t[1]) + vertex_normals->col(t[2]);
    normals.col(n) = normal.normalized();
  }
  return gridRotation(normals, areas);
}

Eigen::Matrix3d gridRotation(const Eigen::Matrix3Xf& normals, const Eigen::VectorXf& areas) {
  if (!(areas.sum() > 0.0F)) return Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d R = manhattanFrame(normals, areas).R_map_frame;
  // A grid that is all but straight stays straight: its samples then coincide with those of the fusion.
  constexpr double kStraight = 5e-4;
  return Eigen::AngleAxisd(R).angle() < kStraight ? Eigen::Matrix3d(Eigen::Matrix3d::Identity()) : R;
}

GridGeometry gridAround(const Eigen::Matrix3Xf& points_map, const Eigen::Matrix3d& R_map_grid,
                        double voxel_size, double margin) {
  const Eigen::Matrix3Xf local = R_map_grid.transpose().cast<float>() * points_map;
  const Eigen::Array3d low = local.rowwise().minCoeff().cast<double>().array() - margin;
  const Eigen::Array3d high = local.rowwise().maxCoeff().cast<double>().array() + margin;
  const Eigen::Array3d first = (low / voxel_size).floor(), last = (high / voxel_size).ceil();
  const Eigen::Array3d extents = last - first + 1.0;
  // Offsets of the distance transform are 16-bit numbers.
  constexpr double kMaxSum = 16000.0, kMaxSamples = 2147483648.0;
  if (!(extents.sum() <= kMaxSum && extents.prod() <= kMaxSamples)) {
    std::ostringstream text;
    text << "signed field: got " << (high - low).transpose() << " m with the margin at voxels of "
         << voxel_size << " m, that is " << extents.transpose()
         << " samples; wanted at most 2^31, extents up to " << kMaxSum
         << " in sum (larger voxels, or another scale?)";
    throw std::invalid_argument(text.str());
  }
  GridGeometry geometry;
  geometry.dims = extents.cast<int>();
  geometry.voxel_size = voxel_size;
  geometry.T_map_grid.linear() = R_map_grid;
  geometry.T_map_grid.translation() = R_map_grid * (voxel_size * first).matrix();
  return geometry;
}

void toIndexCoordinates(ObservedSurface& surface, const GridGeometry& geometry) {
  const Eigen::Isometry3d T_grid_map = geometry.T_map_grid.inverse();
  const double scale = 1.0 / geometry.voxel_size;
  const Eigen::Matrix3f A = (scale * T_grid_map.linear()).cast<float>();
  const Eigen::Vector3f b = (scale * T_grid_map.translation()).cast<float>();
  surface.mesh.vertices = (A * surface.mesh.vertices).colwise() + b;
  surface.normals = geometry.T_map_grid.linear().transpose().cast<float>() * surface.normals;
}

float exactRange(const BuildOptions& options, double voxel_size) {
  if (options.clamp_negative <= 0.0 || options.clamp_positive <= 0.0)
    return std::numeric_limits<float>::max() / 4.0F;
  return static_cast<float>(std::max(options.clamp_negative, options.clamp_positive) / voxel_size) + 1.0F;
}

float clampedTo(const BuildOptions& options, float metres) {
  if (options.clamp_negative > 0.0) metres = std::max(metres, -static_cast<float>(options.clamp_negative));
  if (options.clamp_positive > 0.0) metres = std::min(metres, static_cast<float>(options.clamp_positive));
  return metres;
}

}  // namespace ttsdf
