#pragma once
// The OpenVDB side of TsdfVolume: the only public header that includes OpenVDB, for the sources and tests of
// mapping/.

#include <openvdb/openvdb.h>

#include <cstddef>

#include "ttsdf_localization/fusion/tsdf_volume.h"

namespace ttsdf {

/// What is known about one sample. The signed distance takes precedence: a band voxel may have been seen free
/// as well (by a ray that passed in front of the surface, or after something moved).
enum class VoxelState {
  kUnknown,   ///< no ray got there
  kFree,      ///< crossed by rays, further than the truncation from any surface they hit
  kBand,      ///< signed distance in [-truncation, +truncation], positive on the side of the camera
  kInterior,  ///< inside a closed solid beyond the band (only volumes read from closed level sets have such
              ///< voxels)
};

/// All three grids share one transform, index i <-> world voxel_size * i: values are samples *at* the integer
/// coordinates, which is what OpenVDB's own tools (volumeToMesh, BoxSampler) assume.
struct TsdfVolume::Grids {
  /// Signed distance [m]. Background +truncation. Active: band. Inactive and negative: interior of a closed
  /// level set.
  openvdb::FloatGrid::Ptr tsdf;
  /// Sum of observation weights (1: one frame, head on, from within 1 m), the same topology as `tsdf`,
  /// background 0.
  openvdb::FloatGrid::Ptr weight;
  /// Seen free at some time. An 8^3 leaf that is free throughout is stored as one tile.
  openvdb::MaskGrid::Ptr free;
  /// Scans integrated so far.
  std::size_t frame_count = 0;
};

/// Reads the state of single voxels with cached accessors. Not thread-safe: one reader per thread; do not
/// keep it across changes of the volume.
class VoxelReader {
 public:
  explicit VoxelReader(const TsdfVolume::Grids& grids)
      : tsdf_(grids.tsdf->getConstAccessor()),
        weight_(grids.weight->getConstAccessor()),
        free_(grids.free->getConstAccessor()) {}

  VoxelState state(const openvdb::Coord& ijk) const {
    float value = 0.0F;
    if (tsdf_.probeValue(ijk, value)) return VoxelState::kBand;
    if (value < 0.0F) return VoxelState::kInterior;
    return free_.isValueOn(ijk) ? VoxelState::kFree : VoxelState::kUnknown;
  }
  /// [m]; +-truncation outside the band.
  float distance(const openvdb::Coord& ijk) const { return tsdf_.getValue(ijk); }
  float weight(const openvdb::Coord& ijk) const { return weight_.getValue(ijk); }

 private:
  openvdb::FloatGrid::ConstAccessor tsdf_, weight_;
  openvdb::MaskGrid::ConstAccessor free_;
};

}  // namespace ttsdf
