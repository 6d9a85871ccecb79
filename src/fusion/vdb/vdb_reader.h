#pragma once
// .vdb files, read in a process of their own: a changed byte corrupts OpenVDB's heap or lets it print without
// end. What comes back is rebuilt here from tiles and leaves that were checked.

#include <openvdb/openvdb.h>

#include <string>
#include <vector>

namespace ttsdf {

struct VdbFileGrids {
  openvdb::FloatGrid::Ptr distance;  ///< the grid that was asked for; double precision arrives as single
  openvdb::FloatGrid::Ptr weight;    ///< of a saved volume only
  openvdb::MaskGrid::Ptr free;       ///< of a saved volume only
  /// Of a saved volume: what its metadata say; version 0: somebody else's file.
  int version = 0;
  double voxel_size = 0.0, truncation = 0.0;
  std::int64_t frames = 0;
  openvdb::Vec3d origin{0.0, 0.0, 0.0};
  std::string note;  ///< which grid was taken where there was a choice
};

// Metadata of the grid "tsdf" by which a saved volume is known.
constexpr char kVdbVersionKey[] = "ttsdf_volume_version";
constexpr char kVdbVoxelSizeKey[] = "ttsdf_voxel_size";
constexpr char kVdbTruncationKey[] = "ttsdf_truncation";
constexpr char kVdbFramesKey[] = "ttsdf_frames";
constexpr char kVdbOriginKey[] = "ttsdf_origin";

/// `grid`: the name of the grid to read; empty: the only one of real numbers, or the only level set among
/// several. Throws std::runtime_error naming the file; where several grids could be meant, the message lists
/// them.
VdbFileGrids readVdbFile(const std::string& path, const std::string& grid);

}  // namespace ttsdf
