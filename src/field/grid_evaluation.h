#pragma once
// The way of points through a field on a grid.

#include <algorithm>
#include <array>
#include <cstddef>

#include "grid_locator.h"

namespace ttsdf {

/// `sample(a, b, c)`: the value at a chain index.
template <class Sample>
void fillStencils(const GridLocator& grid, const CellChunk& cells, const Sample& sample, StencilChunk& out) {
  for (int p = 0; p < cells.size; ++p) {
    std::array<int, 3> index{{cells.cell[0][p], cells.cell[1][p], cells.cell[2][p]}};
    out.value[p][0] = sample(index[0], index[1], index[2]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int centre = index[axis];
      const DifferenceStencil d = differenceStencil(centre, grid.sizes()[axis]);
      float sum = 0.0f;
      for (int t = 0; t < 3; ++t) {
        if (d.weight[t] == 0.0f) continue;
        index[axis] = d.index[t];
        sum += d.weight[t] * sample(index[0], index[1], index[2]);
      }
      index[axis] = centre;
      out.value[p][axis + 1] = sum;
    }
  }
}

/// `samples` has a `grid`, and fills the chunks: `corners(cells, out)`, `stencils(cells, out)`.
template <class Samples>
void evaluateOnGrid(Samples& samples, const PointSpan& points, const SampleSpan& out) {
  const bool nearest = samples.grid.interpolation() == Interpolation::kNearest;
  CellChunk cells;
  CornerChunk corners;
  StencilChunk stencils;
  for (int begin = 0; begin < points.size; begin += kChunk) {
    cells.size = std::min(kChunk, points.size - begin);
    samples.grid.locate(points, begin, cells);
    if (nearest) {
      samples.stencils(cells, stencils);
      samples.grid.copy(cells, stencils, out, begin);
    } else {
      samples.corners(cells, corners);
      samples.grid.interpolate(cells, corners, out, begin);
    }
  }
}

}  // namespace ttsdf
