#pragma once
// Where the map knows anything: one bit per cell of `cell_voxels`^3 voxels. A point in a cell without support
// is "unknown": its nearest observed surface point lies sideways of it, beyond the border of what was mapped.

#include <cstdint>
#include <vector>

#include "ttsdf_localization/field/grid_geometry.h"

namespace ttsdf {

class SupportMask {
 public:
  /// No mask: everything is supported.
  SupportMask() = default;
  /// All cells `supported`. dims = the voxel grid's; the mask has ceil(dims / cell_voxels) cells.
  SupportMask(const Dims& dims, int cell_voxels, bool supported);

  bool empty() const { return bits_.empty(); }
  int cellVoxels() const { return cell_voxels_; }
  const Dims& cellDims() const { return cell_dims_; }
  const std::vector<std::uint64_t>& bits() const { return bits_; }
  std::vector<std::uint64_t>& bits() { return bits_; }

  /// Cell (a, b, c) covers voxels [a, a + 1) * cell_voxels etc.; linear index a + na * (b + nb * c).
  void set(int a, int b, int c, bool supported);
  bool at(int a, int b, int c) const { return bit(linear(a, b, c)); }
  /// Support at a voxel index (nearest sample). Indices must lie in the grid.
  bool atVoxel(int i, int j, int k) const {
    return bits_.empty() || bit(linear(i / cell_voxels_, j / cell_voxels_, k / cell_voxels_));
  }
  double supportedShare() const;
  std::size_t memoryBytes() const { return bits_.size() * sizeof(std::uint64_t); }

 private:
  std::size_t linear(int a, int b, int c) const {
    return static_cast<std::size_t>(a) +
           static_cast<std::size_t>(cell_dims_[0]) *
               (static_cast<std::size_t>(b) +
                static_cast<std::size_t>(cell_dims_[1]) * static_cast<std::size_t>(c));
  }
  bool bit(std::size_t n) const { return (bits_[n >> 6] >> (n & 63)) & 1u; }

  Dims cell_dims_ = Dims::Zero();
  int cell_voxels_ = 1;
  std::vector<std::uint64_t> bits_;
};

}  // namespace ttsdf
