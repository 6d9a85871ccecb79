#pragma once
// Brings what one scan says about blocks of 8^3 voxels (leaves of the grids) into the volume. Depth images
// and clouds differ in how they observe a block; the rule of fusion is one and stands here.

#include <array>
#include <functional>
#include <vector>

#include "ttsdf_localization/fusion/tsdf_volume_grids.h"

namespace ttsdf {

using FloatLeaf = openvdb::FloatTree::LeafNodeType;
using MaskLeaf = openvdb::MaskTree::LeafNodeType;
using BlockMask = FloatLeaf::NodeMaskType;
constexpr int kBlockSide = FloatLeaf::DIM;
constexpr int kBlockVoxels = FloatLeaf::SIZE;

/// What one scan says about the voxels of a block, in the leaf's order (z fastest).
struct BlockObservation {
  std::array<float, kBlockVoxels> distance;  ///< [m], in the band; not initialised where the weight is 0
  std::array<float, kBlockVoxels> weight{};  ///< > 0: the voxel lies in the band
  BlockMask free;                            ///< voxels crossed by rays well in front of the surface
  float free_weight = 1.0F;                  ///< what "free" counts against a band that contradicts it
  bool has_band = false;
};

struct BlockVisit {
  openvdb::Coord origin;
  bool all_free = false;     ///< every voxel is free: it is not observed voxel by voxel
  float free_weight = 1.0F;  ///< as in BlockObservation, where all_free
};

/// Fills the (fresh) observation of visits[index]. Called from several threads at once.
using ObserveBlock = std::function<void(std::size_t index, BlockObservation& observation)>;

/// How much a band observation counts by its own distance: fully within a voxel of the surface it saw, little
/// at the ends of the band, where the nearest surface may be another one (near the corners of a room: an edge
/// of the other wall's band).
float bandWeight(float distance, float voxel_size, float truncation);

/// Rules, per voxel:
/// - band: weighted average of signed distances; the weight is capped at options.max_weight;
/// - free: the voxel is marked free. If it holds band, +truncation is averaged in where that band must be
/// wrong: it is
///   negative (inside of something), or no negative band is left within the truncation (the thing it belonged
///   to is gone). Band next to a surface that still stands is left alone: rays that pass a surface closely on
///   their way to another one know less about its distance than the rays that hit it.
/// - voxels that reached half the truncation that way leave the band.
/// Visits must have distinct origins. Runs on the calling TBB arena; results do not depend on its threads.
void updateBlocks(TsdfVolume::Grids& grids, const FusionOptions& options,
                  const std::vector<BlockVisit>& visits, const ObserveBlock& observe);

}  // namespace ttsdf
