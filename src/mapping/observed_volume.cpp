#include <stdexcept>

#include "parallel.h"
#include "ttsdf_localization/mapping/observed_grid.h"
#include "ttsdf_localization/mapping/tsdf_volume_grids.h"

namespace ttsdf {
namespace {

Observation observation(VoxelState state) {
  switch (state) {
    case VoxelState::kFree:
      return Observation::kFree;
    case VoxelState::kBand:
      return Observation::kBand;
    case VoxelState::kInterior:
      return Observation::kInterior;
    case VoxelState::kUnknown:
      break;
  }
  return Observation::kUnknown;
}

}  // namespace

ObservedGrid observedGrid(const TsdfVolume& volume, int margin, int threads) {
  if (volume.empty())
    throw std::runtime_error("observed grid: got a volume without any observed surface, wanted one");
  const TsdfVolume::Grids& grids = volume.grids();
  openvdb::CoordBBox box = grids.tsdf->evalActiveVoxelBoundingBox();
  box.expand(margin);

  ObservedGrid observed;
  const openvdb::Coord dims = box.dim();
  observed.dims = {dims.x(), dims.y(), dims.z()};
  observed.origin = {box.min().x(), box.min().y(), box.min().z()};
  observed.voxel_size = volume.options().voxel_size;
  observed.truncation = volume.options().truncation;
  const std::size_t slice = static_cast<std::size_t>(dims.x()) * static_cast<std::size_t>(dims.y());
  observed.tsdf.resize(slice * static_cast<std::size_t>(dims.z()));
  observed.state.resize(observed.tsdf.size());
  // Eight slices share the leaves of the tree.
  parallelFor((dims.z() + 7) / 8, threads, [&](int portion) {
    const VoxelReader reader(grids);
    for (int k = 8 * portion; k < std::min(dims.z(), 8 * portion + 8); ++k) {
      std::size_t n = slice * static_cast<std::size_t>(k);
      for (int j = 0; j < dims.y(); ++j) {
        for (int i = 0; i < dims.x(); ++i, ++n) {
          const openvdb::Coord ijk = box.min().offsetBy(i, j, k);
          observed.state[n] = observation(reader.state(ijk));
          observed.tsdf[n] = reader.distance(ijk);
        }
      }
    }
  });
  return observed;
}

}  // namespace ttsdf
