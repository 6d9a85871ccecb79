#include "vdb_import.h"

#include <openvdb/tools/LevelSetRebuild.h>

#include <algorithm>
#include <cmath>

#include "../depth/block_update.h"

namespace ttsdf {

namespace {

constexpr double kLatticeTolerance = 1e-6;  // [voxel]
constexpr float kImportWeight = 1.0F;

bool touchesInactiveOutside(const openvdb::FloatGrid::ConstAccessor& accessor, const openvdb::Coord& ijk) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const int step : {-1, 1}) {
      openvdb::Coord neighbour = ijk;
      neighbour[axis] += step;
      float value = 0.0F;
      if (!accessor.probeValue(neighbour, value) && value >= 0.0F) return true;
    }
  }
  return false;
}

/// A level set on the volume's own lattice: its band is copied, the interior keeps its sign.
void copyLevelSet(const openvdb::FloatGrid& source, float truncation, TsdfVolume::Grids& grids) {
  openvdb::FloatTree& tsdf = grids.tsdf->tree();
  tsdf.topologyUnion(source.tree());
  tsdf.voxelizeActiveTiles();
  const auto band = source.getConstAccessor();
  for (auto it = source.cbeginValueAll(); it; ++it) {
    if (!it.isVoxelValue() && *it < 0.0F) tsdf.sparseFill(it.getBoundingBox(), -truncation, false);
  }
  for (auto leaf = tsdf.beginLeaf(); leaf; ++leaf) {
    for (auto voxel = leaf->beginValueAll(); voxel; ++voxel) {
      const float value = std::clamp(band.getValue(voxel.getCoord()), -truncation, truncation);
      if (std::abs(value) < truncation) {
        leaf->setValueOn(voxel.pos(), value);
      } else {
        leaf->setValueOff(voxel.pos(), value);
      }
    }
  }
}

void weighActiveVoxels(TsdfVolume::Grids& grids) {
  grids.weight->tree().topologyUnion(grids.tsdf->tree());
  for (auto voxel = grids.weight->beginValueOn(); voxel; ++voxel) voxel.setValue(kImportWeight);
}

void markOutsideFree(TsdfVolume::Grids& grids) {
  openvdb::CoordBBox box = grids.tsdf->evalActiveVoxelBoundingBox();
  box.expand(std::max(kBlockSide, box.dim().asVec3i()[box.maxExtent()] / 2));
  openvdb::MaskTree inside(false);
  for (auto it = grids.tsdf->cbeginValueAll(); it; ++it) {
    if (*it < 0.0F) inside.sparseFill(it.getBoundingBox(), true);
  }
  grids.free->tree().sparseFill(box, true);
  grids.free->tree().topologyDifference(inside);
}

/// Trilinear interpolation that knows which samples are known.
class KnownSampler {
 public:
  explicit KnownSampler(const openvdb::FloatGrid& grid)
      : transform_(grid.transform()), accessor_(grid.getConstAccessor()) {}

  /// False if a sample it needs is not active.
  bool sample(const openvdb::Vec3d& world, float* value) const {
    const openvdb::Vec3d index = transform_.worldToIndex(world);
    openvdb::Coord base = openvdb::Coord::floor(index);
    double share[3];
    for (int axis = 0; axis < 3; ++axis) {
      share[axis] = index[axis] - base[axis];
      if (share[axis] > 1.0 - kLatticeTolerance) ++base[axis], share[axis] = 0.0;
      if (share[axis] < kLatticeTolerance) share[axis] = 0.0;
    }
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      double weight = 1.0;
      openvdb::Coord ijk = base;
      for (int axis = 0; axis < 3; ++axis) {
        const int upper = (corner >> axis) & 1;
        ijk[axis] += upper;
        weight *= upper ? share[axis] : 1.0 - share[axis];
      }
      float corner_value = 0.0F;
      if (weight == 0.0) continue;
      if (!accessor_.probeValue(ijk, corner_value)) return false;
      sum += weight * corner_value;
    }
    *value = static_cast<float>(sum);
    return true;
  }

 private:
  const openvdb::math::Transform& transform_;
  openvdb::FloatGrid::ConstAccessor accessor_;
};

/// The rebuilt band is exact to a few percent of a voxel at the surface and to half a voxel at its ends;
/// where the source has all samples, interpolation between them is better.
void refineBand(const openvdb::FloatGrid& source, float truncation, TsdfVolume::Grids& grids) {
  const KnownSampler sampler(source);
  for (auto voxel = grids.tsdf->beginValueOn(); voxel; ++voxel) {
    float value = 0.0F;
    if (sampler.sample(grids.tsdf->indexToWorld(voxel.getCoord()), &value) && std::abs(value) < truncation) {
      voxel.setValue(value);
    }
  }
}

/// Blocks of the volume's lattice that active values of the source reach.
openvdb::MaskTree touchedBlocks(const openvdb::FloatGrid& source, const openvdb::math::Transform& lattice) {
  openvdb::MaskTree blocks(false);
  for (auto it = source.tree().cbeginLeaf(); it; ++it) {
    openvdb::CoordBBox box;
    if (it->isEmpty()) continue;
    it->evalActiveBoundingBox(box);
    const openvdb::BBoxd world = source.transform().indexToWorld(box);
    const openvdb::CoordBBox target = lattice.worldToIndexNodeCentered(world).expandBy(1);
    for (int x = target.min().x() & ~7; x <= target.max().x(); x += kBlockSide) {
      for (int y = target.min().y() & ~7; y <= target.max().y(); y += kBlockSide) {
        for (int z = target.min().z() & ~7; z <= target.max().z(); z += kBlockSide)
          blocks.touchLeaf({x, y, z});
      }
    }
  }
  return blocks;
}

}  // namespace

VdbSurface classifySurface(const openvdb::FloatGrid& grid) {
  bool negative = false, open = false;
  const auto accessor = grid.getConstAccessor();
  for (auto it = grid.cbeginValueOn(); it; ++it) {
    if (std::isnan(*it)) return VdbSurface::kBroken;
    if (*it >= 0.0F) continue;
    negative = true;
    open = open || touchesInactiveOutside(accessor, it.getCoord());
  }
  if (!negative) return VdbSurface::kNone;
  return open ? VdbSurface::kOpen : VdbSurface::kClosed;
}

void importClosed(const openvdb::FloatGrid& source, const FusionOptions& options, TsdfVolume::Grids& grids) {
  const auto truncation = static_cast<float>(options.truncation);
  const openvdb::math::Transform& lattice = grids.tsdf->transform();
  if (source.transform() == lattice && source.background() >= truncation * (1.0F - 1e-5F)) {
    copyLevelSet(source, truncation, grids);
  } else {
    const auto half_width = static_cast<float>(options.truncation / options.voxel_size);
    copyLevelSet(*openvdb::tools::levelSetRebuild(source, 0.0F, half_width, &lattice), truncation, grids);
    refineBand(source, truncation, grids);
  }
  weighActiveVoxels(grids);
  markOutsideFree(grids);
}

void importOpen(const openvdb::FloatGrid& source, const FusionOptions& options, TsdfVolume::Grids& grids) {
  const auto truncation = static_cast<float>(options.truncation);
  const float band_end = truncation * (1.0F - 1e-5F);
  openvdb::FloatGrid flat(source);  // active tiles (free space of others) as voxels
  flat.tree().voxelizeActiveTiles();
  const KnownSampler sampler(flat);
  const openvdb::MaskTree blocks = touchedBlocks(flat, grids.tsdf->transform());
  auto tsdf = grids.tsdf->getAccessor();
  auto free = grids.free->getAccessor();
  for (auto leaf = blocks.cbeginLeaf(); leaf; ++leaf) {
    for (openvdb::Index n = 0; n < kBlockVoxels; ++n) {
      const openvdb::Coord ijk = leaf->offsetToGlobalCoord(n);
      float value = 0.0F;
      if (!sampler.sample(grids.tsdf->indexToWorld(ijk), &value)) continue;
      if (std::abs(value) < band_end) {
        tsdf.setValue(ijk, value);
      } else if (value > 0.0F) {
        free.setValueOn(ijk);
      }
    }
  }
  weighActiveVoxels(grids);
}

}  // namespace ttsdf
