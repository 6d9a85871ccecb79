#include "ttsdf_localization/geometry/local_origin.h"
#include "ttsdf_localization/map/tt_sdf_map.h"
#include "ttsdf_localization/signed_field/field_bricks.h"
#include "ttsdf_localization/signed_field/sampled_field.h"
#include "ttsdf_localization/signed_field/sampled_field_methods.h"
#include "ttsdf_localization/surface/observed_surface.h"
#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf {

namespace {

/// The mesh in the map frame; the grid's samples sit at integers.
SurfaceMesh inMapFrame(SurfaceMesh mesh, const GridGeometry& geometry) {
  const Eigen::Matrix3f A = (geometry.voxel_size * geometry.T_map_grid.linear()).cast<float>();
  const Eigen::Vector3d low = geometry.samplePosition(Eigen::Vector3d::Zero());
  const Eigen::Vector3d high = geometry.samplePosition((geometry.dims - 1).cast<double>().matrix());
  mesh.origin = localOrigin(low.cwiseMin(high), low.cwiseMax(high));
  mesh.vertices =
      (A * mesh.vertices).colwise() + (geometry.T_map_grid.translation() - mesh.origin).cast<float>();
  return mesh;
}

/// A field read as if it had been observed where its mask supports it.
SurfaceMesh zeroLevel(const DenseTensor& values, const SupportMask& mask, const GridGeometry& geometry) {
  ObservedGrid grid;
  grid.dims = values.dims();
  grid.voxel_size = geometry.voxel_size;
  grid.truncation = 3.0 * geometry.voxel_size;
  grid.tsdf.assign(values.data(), values.data() + values.size());
  grid.state.assign(values.size(), Observation::kUnknown);
  const auto reach = static_cast<float>(grid.truncation);
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      for (int i = 0; i < grid.dims[0]; ++i) {
        const std::size_t n = grid.offset(i, j, k);
        if (!mask.atVoxel(i, j, k)) continue;
        const float value = grid.tsdf[n];
        grid.state[n] = value > reach    ? Observation::kFree
                        : value < -reach ? Observation::kInterior
                                         : Observation::kBand;
      }
    }
  }
  SurfaceMesh mesh = observedSurface(grid, kMinSurfacePiece).mesh;
  if (mesh.empty()) return mesh;
  mesh.vertices /= static_cast<float>(geometry.voxel_size);
  return inMapFrame(std::move(mesh), geometry);
}

}  // namespace

SurfaceMesh extractSurface(const TsdfVolume& volume) {
  if (volume.empty()) return {};
  SurfaceMesh mesh =
      observedSurface(observedGrid(volume, 2, volume.options().threads), kMinSurfacePiece).mesh;
  mesh.origin = volume.origin();
  return mesh;
}

SurfaceMesh extractSurface(const SampledField& field) {
  if (!field.bricks) return zeroLevel(field.values, field.mask, field.geometry);
  DenseTensor values(field.geometry.dims);
  for (int k = 0; k < values.dims()[2]; ++k)
    field.bricks->readSlab({2, k, 0, 1, 0, values.dims()[1]}, values.data() + values.offset(0, 0, k),
                           nullptr);
  return zeroLevel(values, field.mask, field.geometry);
}

SurfaceMesh extractSurface(const TtSdfMap& map) { return zeroLevel(full(map.train), map.mask, map.geometry); }

}  // namespace ttsdf
