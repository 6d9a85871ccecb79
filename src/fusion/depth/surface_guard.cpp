#include "surface_guard.h"

#include <algorithm>
#include <cstdint>

namespace ttsdf {

namespace {

constexpr int kMaxRadius = 4;
constexpr int kGuardSide = kBlockSide + 2 * kMaxRadius;  // block with its surroundings

/// One bit per voxel of the block and its surroundings: bit z of rows[x][y], offset by kMaxRadius.
struct SurroundingBits {
  std::uint16_t rows[kGuardSide][kGuardSide] = {};
};
static_assert(kGuardSide <= 16, "a row must fit its word");

/// Part of [0, 8) of a neighbouring block at `step` (-1, 0, 1 blocks away) that lies within `radius` of the
/// block.
struct GuardSpan {
  GuardSpan(int step, int radius)
      : begin(step < 0 ? kBlockSide - radius : 0),
        end(step > 0 ? radius : kBlockSide),
        shift(step * kBlockSide + kMaxRadius) {}
  int begin, end, shift;
};

template <class IsNegative>
void collect(const GuardSpan& x, const GuardSpan& y, const GuardSpan& z, SurroundingBits& bits,
             const IsNegative& negative) {
  for (int i = x.begin; i < x.end; ++i) {
    for (int j = y.begin; j < y.end; ++j) {
      unsigned row = 0;
      for (int k = z.begin; k < z.end; ++k) {
        row |= static_cast<unsigned>(negative((i << 6) | (j << 3) | k)) << (k + z.shift);
      }
      bits.rows[i + x.shift][j + y.shift] |= static_cast<std::uint16_t>(row);
    }
  }
}

SurroundingBits negativeVoxels(const openvdb::FloatTree& tsdf, const openvdb::Coord& origin, int radius) {
  SurroundingBits bits;
  openvdb::tree::ValueAccessor<const openvdb::FloatTree, false> accessor(tsdf);
  for (int dx = -1; dx <= 1; ++dx) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dz = -1; dz <= 1; ++dz) {
        const openvdb::Coord neighbour = origin.offsetBy(dx * kBlockSide, dy * kBlockSide, dz * kBlockSide);
        const GuardSpan x(dx, radius), y(dy, radius), z(dz, radius);
        if (const FloatLeaf* leaf = accessor.probeConstLeaf(neighbour)) {
          const float* values = leaf->buffer().data();
          collect(x, y, z, bits, [values](int n) { return values[n] < 0.0F; });
        } else if (accessor.getValue(neighbour) < 0.0F) {
          collect(x, y, z, bits, [](int) { return true; });
        }
      }
    }
  }
  return bits;
}

}  // namespace

BlockMask nearNegative(const openvdb::FloatTree& tsdf, const openvdb::Coord& origin, int radius) {
  radius = std::clamp(radius, 1, kMaxRadius);
  const SurroundingBits bits = negativeVoxels(tsdf, origin, radius);
  // Dilation by a cube: along z within the words, then along y, then along x.
  std::uint16_t along_zy[kGuardSide][kBlockSide] = {};
  for (int i = kMaxRadius - radius; i < kGuardSide - kMaxRadius + radius; ++i) {
    std::uint16_t along_z[kGuardSide] = {};
    for (int j = 0; j < kGuardSide; ++j) {
      unsigned row = bits.rows[i][j];
      for (int r = 1; r <= radius; ++r)
        row |= (static_cast<unsigned>(bits.rows[i][j]) << r) | (bits.rows[i][j] >> r);
      along_z[j] = static_cast<std::uint16_t>(row);
    }
    for (int j = 0; j < kBlockSide; ++j) {
      for (int r = -radius; r <= radius; ++r) along_zy[i][j] |= along_z[j + kMaxRadius + r];
    }
  }
  BlockMask mask;
  for (int i = 0; i < kBlockSide; ++i) {
    for (int j = 0; j < kBlockSide; ++j) {
      unsigned row = 0;
      for (int r = -radius; r <= radius; ++r) row |= along_zy[i + kMaxRadius + r][j];
      for (int k = 0; k < kBlockSide; ++k) {
        if ((row >> (k + kMaxRadius)) & 1U) mask.setOn(static_cast<openvdb::Index>((i << 6) | (j << 3) | k));
      }
    }
  }
  return mask;
}

}  // namespace ttsdf
