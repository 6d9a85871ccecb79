#include <algorithm>
#include <stdexcept>

#include "../build_steps/parallel.h"
#include "ttsdf_localization/fusion/tsdf_volume_grids.h"
#include "ttsdf_localization/surface/observed_grid.h"

namespace ttsdf {
namespace {

using FloatLeaf = openvdb::FloatTree::LeafNodeType;
using MaskLeaf = openvdb::MaskTree::LeafNodeType;
constexpr int kLeafEdge = FloatLeaf::DIM;

/// Copies block by block: a leaf of the trees is looked up once for its 8^3 voxels.
class BlockCopier {
 public:
  BlockCopier(const TsdfVolume::Grids& grids, ObservedGrid& observed)
      : tsdf_(grids.tsdf->getConstAccessor()), free_(grids.free->getConstAccessor()), observed_(observed) {}

  /// All blocks whose first voxel has this z.
  void copyLayer(int z) {
    const Eigen::Array3i& origin = observed_.origin;
    const Eigen::Array3i end = origin + observed_.dims;
    for (int y = floored(origin[1]); y < end[1]; y += kLeafEdge) {
      for (int x = floored(origin[0]); x < end[0]; x += kLeafEdge) copyBlock({x, y, z});
    }
  }

  static int floored(int index) { return index & ~(kLeafEdge - 1); }

 private:
  /// One value and one state throughout.
  void fillBlock(const Eigen::Array3i& low, const Eigen::Array3i& high, float value, Observation state) {
    for (int z = low[2]; z < high[2]; ++z) {
      for (int y = low[1]; y < high[1]; ++y) {
        const Eigen::Array3i local = Eigen::Array3i(low[0], y, z) - observed_.origin;
        const std::size_t n = observed_.offset(local[0], local[1], local[2]);
        std::fill_n(observed_.tsdf.begin() + static_cast<std::ptrdiff_t>(n), high[0] - low[0], value);
        std::fill_n(observed_.state.begin() + static_cast<std::ptrdiff_t>(n), high[0] - low[0], state);
      }
    }
  }

  static Observation stateOf(float value, bool active, bool is_free) {
    if (active) return Observation::kBand;
    if (value < 0.0F) return Observation::kInterior;
    return is_free ? Observation::kFree : Observation::kUnknown;
  }

  void copyBlock(const Eigen::Array3i& block) {
    const openvdb::Coord corner(block[0], block[1], block[2]);
    const FloatLeaf* tsdf = tsdf_.probeConstLeaf(corner);
    const MaskLeaf* free = free_.probeConstLeaf(corner);
    const bool tile_active = !tsdf && tsdf_.isValueOn(corner), tile_free = !free && free_.isValueOn(corner);
    const float tile_value = tsdf ? 0.0F : tsdf_.getValue(corner);
    const Eigen::Array3i low = block.max(observed_.origin);
    const Eigen::Array3i high = (block + kLeafEdge).min(observed_.origin + observed_.dims);
    if (!tsdf && !free) {
      fillBlock(low, high, tile_value, stateOf(tile_value, tile_active, tile_free));
      return;
    }
    for (int z = low[2]; z < high[2]; ++z) {
      for (int y = low[1]; y < high[1]; ++y) {
        const Eigen::Array3i local = Eigen::Array3i(low[0], y, z) - observed_.origin;
        std::size_t n = observed_.offset(local[0], local[1], local[2]);
        for (int x = low[0]; x < high[0]; ++x, ++n) {
          const auto place =
              static_cast<openvdb::Index>(((x - block[0]) << 6) | ((y - block[1]) << 3) | (z - block[2]));
          const float value = tsdf ? tsdf->getValue(place) : tile_value;
          const bool active = tsdf ? tsdf->isValueOn(place) : tile_active;
          observed_.tsdf[n] = value;
          observed_.state[n] = stateOf(value, active, free ? free->isValueOn(place) : tile_free);
        }
      }
    }
  }

  openvdb::FloatGrid::ConstAccessor tsdf_;
  openvdb::MaskGrid::ConstAccessor free_;
  ObservedGrid& observed_;
};

}  // namespace

ObservedGrid observedGrid(const TsdfVolume& volume, int margin, int threads) {
  if (volume.empty())
    throw std::runtime_error("observed grid: got a volume without any observed surface, wanted one");
  openvdb::CoordBBox box = volume.grids().tsdf->evalActiveVoxelBoundingBox();
  box.expand(margin);
  const openvdb::Coord dims = box.dim();
  return observedGrid(volume, {box.min().x(), box.min().y(), box.min().z()}, {dims.x(), dims.y(), dims.z()},
                      threads);
}

ObservedGrid observedGrid(const TsdfVolume& volume, const Eigen::Array3i& origin, const Dims& dims,
                          int threads) {
  ObservedGrid observed;
  observed.dims = dims;
  observed.origin = origin;
  observed.voxel_size = volume.options().voxel_size;
  observed.truncation = volume.options().truncation;
  const std::size_t count = static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
                            static_cast<std::size_t>(dims[2]);
  observed.tsdf.resize(count);
  observed.state.resize(count);
  const int first = BlockCopier::floored(origin[2]);
  const int layers = (origin[2] + dims[2] - first + kLeafEdge - 1) / kLeafEdge;
  parallelFor(layers, threads,
              [&](int layer) { BlockCopier(volume.grids(), observed).copyLayer(first + kLeafEdge * layer); });
  return observed;
}

}  // namespace ttsdf
