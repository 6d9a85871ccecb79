#include "ttsdf_localization/fusion/volume_parts.h"

#include <cmath>
#include <cstring>
#include <stdexcept>
#include <type_traits>

#include "ttsdf_localization/fusion/tsdf_volume_grids.h"

namespace ttsdf {

namespace {

/// Not by a copy of the whole that is clipped: a hundred parts would copy it a hundred times.
template <class Grid>
typename Grid::Ptr clippedCopy(const Grid& grid, const openvdb::CoordBBox& box) {
  using GridTree = typename Grid::TreeType;
  auto part = Grid::create(grid.background());
  part->setTransform(grid.transform().copy());
  part->setGridClass(grid.getGridClass());
  part->setName(grid.getName());
  auto tile = grid.tree().cbeginValueAll();
  tile.setMaxDepth(GridTree::ValueAllCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    openvdb::CoordBBox bounds;
    tile.getBoundingBox(bounds);
    if (!bounds.hasOverlap(box) || (!tile.isValueOn() && *tile == grid.background())) continue;
    bounds.intersect(box);
    part->tree().fill(bounds, *tile, tile.isValueOn());
  }
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    if (leaf->getNodeBoundingBox().hasOverlap(box)) {
      part->tree().addLeaf(new typename GridTree::LeafNodeType(*leaf));
    }
  }
  part->clip(box);
  return part;
}

class ContentSum {
 public:
  template <class Value>
  void add(const Value& value) {
    unsigned char bytes[sizeof(Value)];
    std::memcpy(bytes, &value, sizeof(Value));
    for (const unsigned char byte : bytes) sum_ = (sum_ ^ byte) * 1099511628211ULL;
  }
  /// Boxes of voxels and tiles that are on, with their values.
  template <class Grid>
  void addGrid(const Grid& grid) {
    for (auto it = grid.cbeginValueOn(); it; ++it) {
      openvdb::CoordBBox box;
      it.getBoundingBox(box);
      addBox(box);
      if constexpr (std::is_same_v<Grid, openvdb::FloatGrid>) add(it.getValue());
    }
  }
  void addBox(const openvdb::CoordBBox& box) {
    for (int axis = 0; axis < 3; ++axis) add(box.min()[axis]), add(box.max()[axis]);
  }
  std::uint64_t sum() const { return sum_; }

 private:
  std::uint64_t sum_ = 14695981039346656037ULL;
};

}  // namespace

std::uint64_t contentSum(const TsdfVolume& volume) {
  const TsdfVolume::Grids& grids = volume.grids();
  ContentSum sum;
  for (int axis = 0; axis < 3; ++axis) sum.add(volume.origin()[axis]);
  sum.add(volume.options().voxel_size), sum.add(volume.options().truncation);
  sum.addGrid(*grids.tsdf), sum.addGrid(*grids.weight), sum.addGrid(*grids.free);
  sum.add(grids.frame_count);
  // Behind the band: what is inside of a closed level set.
  for (auto it = grids.tsdf->cbeginValueOff(); it; ++it) {
    if (!(it.getValue() < 0.0F)) continue;
    openvdb::CoordBBox box;
    it.getBoundingBox(box);
    sum.addBox(box);
  }
  return sum.sum();
}

Eigen::AlignedBox3d surfaceBounds(const TsdfVolume& volume) {
  const openvdb::CoordBBox box = volume.grids().tsdf->evalActiveVoxelBoundingBox();
  if (volume.empty()) return {};
  const double voxel = volume.options().voxel_size;
  const auto position = [&](const openvdb::Coord& c) {
    return Eigen::Vector3d(volume.origin() + voxel * Eigen::Vector3d(c.x(), c.y(), c.z()));
  };
  return {position(box.min()), position(box.max())};
}

TsdfVolume partOf(const TsdfVolume& volume, const Eigen::AlignedBox3d& box_map) {
  const double voxel = volume.options().voxel_size;
  const Eigen::Array3i low = ((box_map.min() - volume.origin()) / voxel).array().ceil().cast<int>(),
                       high = ((box_map.max() - volume.origin()) / voxel).array().floor().cast<int>();
  const openvdb::CoordBBox box({low[0], low[1], low[2]}, {high[0], high[1], high[2]});
  TsdfVolume part(volume.options());
  part.setOrigin(volume.origin());
  part.grids().tsdf = clippedCopy(*volume.grids().tsdf, box);
  part.grids().weight = clippedCopy(*volume.grids().weight, box);
  part.grids().free = clippedCopy(*volume.grids().free, box);
  part.grids().frame_count = volume.grids().frame_count;
  return part;
}

std::vector<VolumeCell> cellsOf(const Eigen::AlignedBox3d& box, double size, double overlap) {
  constexpr double kMostCells = 1e5;
  if (box.isEmpty()) throw std::invalid_argument("cells: got an empty box, wanted observed surface");
  if (!(size > 0.0) || !(overlap >= 0.0) || !(overlap < size)) {
    throw std::invalid_argument("cells: got a size of " + std::to_string(size) + " m and an overlap of " +
                                std::to_string(overlap) + " m, wanted a size above 0 and a smaller overlap");
  }
  const Eigen::Array3d count = (box.sizes().array() / size).ceil().max(1.0);
  if (!(count.prod() <= kMostCells)) {
    throw std::invalid_argument("cells: got " + std::to_string(count.prod()) +
                                " cells, wanted at most 100000 (a larger size)");
  }
  const Eigen::Array3d step = box.sizes().array() / count;
  std::vector<VolumeCell> cells;
  for (int k = 0; k < count[2]; ++k) {
    for (int j = 0; j < count[1]; ++j) {
      for (int i = 0; i < count[0]; ++i) {
        const Eigen::Vector3d low = box.min() + (Eigen::Array3d(i, j, k) * step).matrix();
        const Eigen::Vector3d more = Eigen::Vector3d::Constant(0.5 * overlap);
        cells.push_back({"x" + std::to_string(i) + "_y" + std::to_string(j) + "_z" + std::to_string(k),
                         {Eigen::Vector3d(low - more), Eigen::Vector3d(low + step.matrix() + more)}});
      }
    }
  }
  return cells;
}

}  // namespace ttsdf
