#include "grid_locator.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "../tensor/vectorize.h"

namespace ttsdf {

namespace {

// What float rounding may do to a point on the border, in voxels: such a point is inside.
constexpr float kBorderSlack = 1e-3f;

struct LocateArguments {
  const float *x, *y, *z;
  int size;
  const float (*matrix)[4];
  float last[3];       // largest valid index
  float cell_last[3];  // largest valid cell
  bool nearest;
};

TTSDF_VECTORIZE void locateChunk(const LocateArguments& in, CellChunk& cells) {
  const int size = in.size;
  for (int n = 0; n < size; ++n) cells.state[n] = PointState::kValid;
  for (int axis = 0; axis < 3; ++axis) {
    const float* const m = in.matrix[axis];
    const float last = in.last[axis], cell_last = in.cell_last[axis];
    std::int32_t* const cell = cells.cell[axis];
    float* const fraction = cells.fraction[axis];
    alignas(64) std::int32_t outside[kChunk];
    const float half = in.nearest ? 0.5f : 0.0f;
    for (int n = 0; n < size; ++n) {
      const float index = m[0] * in.x[n] + m[1] * in.y[n] + m[2] * in.z[n] + m[3];
      const bool inside =
          (index >= -kBorderSlack) & (index <= last + kBorderSlack);  // false for NaN; no branch
      outside[n] = inside ? 0 : 1;
      const float safe = inside ? std::min(std::max(index, 0.0f), last) : 0.0f;
      const float base = std::min(static_cast<float>(static_cast<std::int32_t>(safe + half)), cell_last);
      cell[n] = static_cast<std::int32_t>(base);
      fraction[n] = safe - base;
    }
    for (int n = 0; n < size; ++n) {
      if (outside[n]) cells.state[n] = PointState::kOutside;
    }
  }
}

/// Trilinear value and gradient (per chain index) from corner samples; `gradient` in units of the index.
TTSDF_VECTORIZE void interpolateChunk(const CellChunk& cells, const CornerChunk& corners, float* value,
                                      float* ga, float* gb, float* gc) {
  const int size = cells.size;
  TTSDF_INDEPENDENT
  for (int n = 0; n < size; ++n) {
    const float* const c = corners.value[n];
    const float u = cells.fraction[0][n], v = cells.fraction[1][n], w = cells.fraction[2][n];
    const float x00 = c[0] + u * (c[1] - c[0]), x10 = c[2] + u * (c[3] - c[2]);
    const float x01 = c[4] + u * (c[5] - c[4]), x11 = c[6] + u * (c[7] - c[6]);
    const float y0 = x00 + v * (x10 - x00), y1 = x01 + v * (x11 - x01);
    const float d0 = (c[1] - c[0]) + v * ((c[3] - c[2]) - (c[1] - c[0]));
    const float d1 = (c[5] - c[4]) + v * ((c[7] - c[6]) - (c[5] - c[4]));
    value[n] = y0 + w * (y1 - y0);
    ga[n] = d0 + w * (d1 - d0);
    gb[n] = (x10 - x00) + w * ((x11 - x01) - (x10 - x00));
    gc[n] = y1 - y0;
  }
}

struct MaskArguments {
  std::int32_t last[3];    // largest sample index
  std::int32_t stride[3];  // of the mask's cells, chain order
  float cells_per_voxel;
};

/// Index of the mask's cell around every point (nearest sample).
TTSDF_VECTORIZE void maskCells(const CellChunk& cells, const MaskArguments& in, std::int32_t* linear) {
  const int size = cells.size;
  for (int n = 0; n < size; ++n) linear[n] = 0;
  for (int mode = 0; mode < 3; ++mode) {
    const std::int32_t last = in.last[mode], stride = in.stride[mode];
    const float cells_per_voxel = in.cells_per_voxel;
    TTSDF_INDEPENDENT
    for (int n = 0; n < size; ++n) {
      const std::int32_t voxel =
          std::min(cells.cell[mode][n] + (cells.fraction[mode][n] >= 0.5f ? 1 : 0), last);
      const float cell = (static_cast<float>(voxel) + 0.5f) * cells_per_voxel;  // never near a whole number
      linear[n] += stride * static_cast<std::int32_t>(cell);
    }
  }
}

/// Gradient to the map frame: df/dp = M^T df/dindex. Outside points get zeros.
TTSDF_VECTORIZE void finishChunk(const CellChunk& cells, const float (*matrix)[4], const float* value,
                                 const float* ga, const float* gb, const float* gc, const SampleSpan& out,
                                 int begin) {
  float m[3][3];
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) m[row][column] = matrix[row][column];
  }
  const int size = cells.size;
  float* const out_value = out.value + begin;
  float* const gx = out.gradient_x + begin;
  float* const gy = out.gradient_y + begin;
  float* const gz = out.gradient_z + begin;
  PointState* const state = out.state + begin;
  TTSDF_INDEPENDENT
  for (int n = 0; n < size; ++n) {
    const bool keep = cells.state[n] != PointState::kOutside;      // a product would keep NaN
    const float da = ga[n], db = gb[n], dc = gc[n], v = value[n];  // no loads on conditions: NEON has none
    const float a = keep ? da : 0.0f, b = keep ? db : 0.0f, c = keep ? dc : 0.0f;
    out_value[n] = keep ? v : 0.0f;
    gx[n] = m[0][0] * a + m[1][0] * b + m[2][0] * c;
    gy[n] = m[0][1] * a + m[1][1] * b + m[2][1] * c;
    gz[n] = m[0][2] * a + m[1][2] * b + m[2][2] * c;
  }
  TTSDF_INDEPENDENT
  for (int n = 0; n < size; ++n) state[n] = cells.state[n];
}

}  // namespace

DifferenceStencil differenceStencil(int n, int size) {
  if (size == 1) return {{0, 0, 0}, {0.0f, 0.0f, 0.0f}};
  if (size == 2) return {{0, 1, 1}, {-1.0f, 1.0f, 0.0f}};
  if (n == 0) return {{0, 1, 2}, {-1.5f, 2.0f, -0.5f}};
  if (n == size - 1) return {{size - 3, size - 2, size - 1}, {0.5f, -2.0f, 1.5f}};
  return {{n - 1, n, n + 1}, {-0.5f, 0.0f, 0.5f}};
}

GridLocator::GridLocator(const GridGeometry& geometry, SupportMask mask, Interpolation interpolation,
                         const ModeOrder& axes)
    : geometry_(geometry), mask_(std::move(mask)), interpolation_(interpolation), axes_(axes), sizes_{} {
  check(geometry_);
  if (!mask_.empty()) {
    const Dims cells = (geometry_.dims + mask_.cellVoxels() - 1) / mask_.cellVoxels();
    if ((cells != mask_.cellDims()).any()) {
      std::ostringstream text;
      text << "distance field: got a support mask of " << mask_.cellDims().transpose() << " cells, wanted "
           << cells.transpose();
      throw std::invalid_argument(text.str());
    }
  }
  const Eigen::Isometry3d T_grid_map = geometry_.T_map_grid.inverse();
  for (std::size_t mode = 0; mode < 3; ++mode) {
    sizes_[mode] = geometry_.dims[axes_[mode]];
    for (int column = 0; column < 4; ++column) {
      index_from_map_[mode][column] =
          static_cast<float>(T_grid_map.matrix()(axes_[mode], column) / geometry_.voxel_size);
    }
  }
}

void GridLocator::locate(const PointSpan& points, int begin, CellChunk& cells) const {
  LocateArguments in{};
  in.x = points.x + begin, in.y = points.y + begin, in.z = points.z + begin;
  in.size = cells.size;
  in.matrix = index_from_map_;
  in.nearest = interpolation_ == Interpolation::kNearest;
  for (std::size_t mode = 0; mode < 3; ++mode) {
    in.last[mode] = static_cast<float>(sizes_[mode] - 1);
    in.cell_last[mode] = static_cast<float>(in.nearest ? sizes_[mode] - 1 : std::max(0, sizes_[mode] - 2));
  }
  locateChunk(in, cells);
  applyMask(cells);
}

void GridLocator::applyMask(CellChunk& cells) const {
  if (mask_.empty()) return;
  MaskArguments in{};
  const Dims& count = mask_.cellDims();
  const std::int32_t stride[3] = {1, count[0], count[0] * count[1]};
  for (std::size_t mode = 0; mode < 3; ++mode) {
    in.last[mode] = sizes_[mode] - 1;
    in.stride[mode] = stride[axes_[mode]];
  }
  in.cells_per_voxel = 1.0f / static_cast<float>(mask_.cellVoxels());
  alignas(64) std::int32_t linear[kChunk];
  maskCells(cells, in, linear);
  const std::uint64_t* const bits = mask_.bits().data();
  for (int n = 0; n < cells.size; ++n) {
    const auto cell = static_cast<std::uint32_t>(linear[n]);
    const bool known = (bits[cell >> 6] >> (cell & 63)) & 1u;
    if (!known && cells.state[n] == PointState::kValid) cells.state[n] = PointState::kUnknown;
  }
}

void GridLocator::interpolate(const CellChunk& cells, const CornerChunk& corners, const SampleSpan& out,
                              int begin) const {
  alignas(64) float value[kChunk], ga[kChunk], gb[kChunk], gc[kChunk];
  interpolateChunk(cells, corners, value, ga, gb, gc);
  finishChunk(cells, index_from_map_, value, ga, gb, gc, out, begin);
}

void GridLocator::copy(const CellChunk& cells, const StencilChunk& stencils, const SampleSpan& out,
                       int begin) const {
  alignas(64) float value[kChunk], ga[kChunk], gb[kChunk], gc[kChunk];
  for (int n = 0; n < cells.size; ++n) {
    value[n] = stencils.value[n][0], ga[n] = stencils.value[n][1];
    gb[n] = stencils.value[n][2], gc[n] = stencils.value[n][3];
  }
  finishChunk(cells, index_from_map_, value, ga, gb, gc, out, begin);
}

}  // namespace ttsdf
