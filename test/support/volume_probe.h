#pragma once
// What tests ask of a fused volume.

#include <vector>

#include "ttsdf_localization/fusion/tsdf_volume_grids.h"

namespace ttsdf::testing {

inline Eigen::Vector3d worldPosition(const TsdfVolume& volume, const openvdb::Coord& ijk) {
  return volume.options().voxel_size * Eigen::Vector3d(ijk.x(), ijk.y(), ijk.z());
}

/// Points where the signed distance crosses zero between neighbouring band voxels, by linear interpolation
/// [m].
inline std::vector<Eigen::Vector3d> zeroCrossings(const TsdfVolume& volume) {
  const VoxelReader reader(volume.grids());
  std::vector<Eigen::Vector3d> points;
  for (auto voxel = volume.grids().tsdf->cbeginValueOn(); voxel; ++voxel) {
    const openvdb::Coord ijk = voxel.getCoord();
    for (int axis = 0; axis < 3; ++axis) {
      openvdb::Coord next = ijk;
      ++next[axis];
      if (reader.state(next) != VoxelState::kBand) continue;
      const double a = *voxel, b = reader.distance(next);
      if ((a < 0.0) == (b < 0.0)) continue;
      points.push_back(worldPosition(volume, ijk) +
                       a / (a - b) * (worldPosition(volume, next) - worldPosition(volume, ijk)));
    }
  }
  return points;
}

/// Same active voxels, values bit for bit, and the same free voxels.
inline bool sameVolumes(const TsdfVolume& a, const TsdfVolume& b) {
  const auto same_floats = [](const openvdb::FloatGrid& x, const openvdb::FloatGrid& y) {
    if (x.activeVoxelCount() != y.activeVoxelCount() || x.transform() != y.transform()) return false;
    const auto accessor = y.getConstAccessor();
    for (auto it = x.cbeginValueOn(); it; ++it) {
      float value = 0.0F;
      if (!accessor.probeValue(it.getCoord(), value) || value != *it) return false;
    }
    return true;
  };
  openvdb::MaskTree difference(a.grids().free->tree());
  difference.topologyDifference(b.grids().free->tree());
  return same_floats(*a.grids().tsdf, *b.grids().tsdf) && same_floats(*a.grids().weight, *b.grids().weight) &&
         a.grids().free->activeVoxelCount() == b.grids().free->activeVoxelCount() &&
         difference.activeVoxelCount() == 0;
}

}  // namespace ttsdf::testing
