#pragma once
// What all fields on a grid share: from points to grid indices, the support mask, trilinear or nearest
// interpolation, gradients back to the map frame. They differ only in where the samples come from.

#include <array>

#include "ttsdf_localization/field/distance_field.h"
#include "ttsdf_localization/field/support_mask.h"
#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {

constexpr int kChunk = 256;  ///< points worked on at a time: all buffers below stay in the first-level cache

/// Integer cell, fraction and state of a chunk of points, axes in the order the samples are stored ("chain
/// order").
struct CellChunk {
  int size = 0;
  alignas(64) std::int32_t cell[3][kChunk];
  alignas(64) float fraction[3][kChunk];
  alignas(64) PointState state[kChunk];
};

/// Samples at the eight corners of every cell: value[n][c], corner c = da + 2 db + 4 dc.
struct CornerChunk {
  alignas(64) float value[kChunk][8];
};

/// Samples around the nearest voxel: the voxel itself, then for each chain axis the derivative by finite
/// differences [1/voxel].
struct StencilChunk {
  alignas(64) float value[kChunk][4];
};

/// Where points lie in a grid, and interpolation between what its corners hold.
class GridLocator {
 public:
  /// Throws std::invalid_argument if mask and geometry disagree. `axes`: the order in which samples are
  /// stored.
  GridLocator(const GridGeometry& geometry, SupportMask mask, Interpolation interpolation,
              const ModeOrder& axes);

  const GridGeometry& geometry() const { return geometry_; }
  const SupportMask& mask() const { return mask_; }
  Interpolation interpolation() const { return interpolation_; }
  /// Extents in chain order.
  const std::array<int, 3>& sizes() const { return sizes_; }

  /// Cells and states of `cells.size` points from `begin` on; outside points lie in the nearest cell.
  void locate(const PointSpan& points, int begin, CellChunk& cells) const;
  /// Trilinear value and gradient from the corners.
  void interpolate(const CellChunk& cells, const CornerChunk& corners, const SampleSpan& out,
                   int begin) const;
  /// Value and finite differences of the nearest voxel.
  void copy(const CellChunk& cells, const StencilChunk& stencils, const SampleSpan& out, int begin) const;

 private:
  void applyMask(CellChunk& cells) const;

  GridGeometry geometry_;
  SupportMask mask_;
  Interpolation interpolation_;
  ModeOrder axes_;
  std::array<int, 3> sizes_;    // extents in chain order
  float index_from_map_[3][4];  // chain index = this * [p; 1]
};

/// The second-order difference of `differentiate` at sample n of a line of `size` samples: indices and
/// weights of three samples.
struct DifferenceStencil {
  int index[3];
  float weight[3];
};
DifferenceStencil differenceStencil(int n, int size);

}  // namespace ttsdf
