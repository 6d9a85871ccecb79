#include "ttsdf_localization/field/long_range_field.h"

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <vector>

namespace ttsdf {

namespace {

/// Points of a regular lattice over the box, `step` voxels apart, in batches through `visit(batch, first
/// linear index)`.
template <class Visitor>
void forEachLattice(const GridGeometry& geometry, double step, const Dims& counts, const Visitor& visit) {
  Eigen::Matrix3Xf batch(3, counts[0]);
  for (int c = 0; c < counts[2]; ++c) {
    for (int b = 0; b < counts[1]; ++b) {
      for (int a = 0; a < counts[0]; ++a) {
        batch.col(a) = geometry.samplePosition(step * Eigen::Vector3d(a, b, c)).cast<float>();
      }
      visit(batch, b, c);
    }
  }
}

Dims latticeCounts(const GridGeometry& geometry, double step) {
  return ((geometry.dims - 1).cast<double>() / step + 1e-6).floor().cast<int>() + 1;
}

struct SurfacePoints {
  std::vector<Eigen::Vector3f> points;
  std::size_t kdtree_get_point_count() const { return points.size(); }
  float kdtree_get_pt(std::size_t n, std::size_t axis) const {
    return points[n][static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

/// Foot points x - f grad f of lattice samples near the zero level, kept where the field agrees that they lie
/// on it.
SurfacePoints footPoints(const DistanceField& field) {
  constexpr double kStep = 2.0;  // voxels; surfaces are continuous over that
  const GridGeometry& geometry = field.geometry();
  const float reach = static_cast<float>(1.8 * kStep * geometry.voxel_size);
  SurfacePoints surface;
  forEachLattice(geometry, kStep, latticeCounts(geometry, kStep),
                 [&](const Eigen::Matrix3Xf& batch, int, int) {
                   const FieldSamples samples = field.evaluate(batch);
                   std::vector<Eigen::Vector3f> feet;
                   for (Eigen::Index n = 0; n < batch.cols(); ++n) {
                     const Eigen::Vector3f g = samples.gradients.col(n);
                     const float g2 = g.squaredNorm();
                     if (samples.states[static_cast<std::size_t>(n)] != PointState::kValid) continue;
                     if (std::abs(samples.values[n]) > reach || g2 < 0.25f) continue;
                     feet.push_back(batch.col(n) - samples.values[n] * g / g2);
                   }
                   if (feet.empty()) return;
                   const Eigen::Map<const Eigen::Matrix3Xf> matrix(feet.front().data(), 3,
                                                                   static_cast<Eigen::Index>(feet.size()));
                   const FieldSamples check = field.evaluate(matrix);
                   for (Eigen::Index n = 0; n < matrix.cols(); ++n) {
                     if (check.states[static_cast<std::size_t>(n)] != PointState::kValid) continue;
                     if (std::abs(check.values[n]) < geometry.voxel_size)
                       surface.points.push_back(matrix.col(n));
                   }
                 });
  return surface;
}

/// The map's box, padded and sampled coarsely: at most max_samples samples.
GridGeometry paddedGrid(const GridGeometry& map, const LongRangeOptions& options) {
  GridGeometry geometry = map;
  const Eigen::Array3d extent = (map.dims - 1).cast<double>() * map.voxel_size + 2.0 * options.padding;
  geometry.voxel_size = options.spacing_voxels * map.voxel_size;
  do {
    geometry.dims = (extent / geometry.voxel_size).ceil().cast<int>() + 1;
    if (geometry.voxelCount() <= options.max_samples) break;
    geometry.voxel_size *= 1.25;
  } while (true);
  geometry.T_map_grid.translation() -= map.T_map_grid.linear() * Eigen::Vector3d::Constant(options.padding);
  return geometry;
}

}  // namespace

std::shared_ptr<const DenseDistanceField> makeLongRangeField(const DistanceField& field,
                                                             const LongRangeOptions& options) {
  const SurfacePoints surface = footPoints(field);
  if (surface.points.empty()) return nullptr;
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, SurfacePoints>,
                                                   SurfacePoints, 3, std::size_t>;
  Tree tree(3, surface, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  tree.buildIndex();

  GridGeometry geometry = paddedGrid(field.geometry(), options);
  DenseTensor values(geometry.dims);
  forEachLattice(geometry, 1.0, geometry.dims, [&](const Eigen::Matrix3Xf& batch, int b, int c) {
    const FieldSamples samples = field.evaluate(batch);
    for (int a = 0; a < geometry.dims[0]; ++a) {
      const Eigen::Vector3f query = batch.col(a);
      std::size_t index = 0;
      float squared = 0.0f;
      tree.knnSearch(query.data(), 1, &index, &squared);
      const float distance = std::sqrt(squared);
      values(a, b, c) =
          samples.values[a] < 0.0f ? -distance : distance;  // outside the box the value is 0: positive
    }
  });
  return std::make_shared<DenseDistanceField>(std::move(values), geometry);
}

}  // namespace ttsdf
