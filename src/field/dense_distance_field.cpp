#include "ttsdf_localization/field/dense_distance_field.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "grid_locator.h"

namespace ttsdf {

class DenseDistanceField::Impl {
 public:
  Impl(DenseTensor values, const GridGeometry& geometry, SupportMask mask, Interpolation interpolation)
      : grid(geometry, std::move(mask), interpolation, ModeOrder{{0, 1, 2}}), tensor(std::move(values)) {
    if ((tensor.dims() == geometry.dims).all()) return;
    std::ostringstream text;
    text << "dense field: got a tensor of " << tensor.dims().transpose() << ", wanted "
         << geometry.dims.transpose();
    throw std::invalid_argument(text.str());
  }

  void corners(const CellChunk& cells, CornerChunk& out) const {
    const auto& n = grid.sizes();
    const std::size_t da = n[0] > 1 ? 1 : 0;
    const std::size_t db = n[1] > 1 ? tensor.offset(0, 1, 0) : 0;
    const std::size_t dc = n[2] > 1 ? tensor.offset(0, 0, 1) : 0;
    for (int p = 0; p < cells.size; ++p) {
      const float* const s =
          tensor.data() + tensor.offset(cells.cell[0][p], cells.cell[1][p], cells.cell[2][p]);
      float* const v = out.value[p];
      v[0] = s[0], v[1] = s[da], v[2] = s[db], v[3] = s[da + db];
      v[4] = s[dc], v[5] = s[da + dc], v[6] = s[db + dc], v[7] = s[da + db + dc];
    }
  }

  void stencils(const CellChunk& cells, StencilChunk& out) const {
    const auto& sizes = grid.sizes();
    for (int p = 0; p < cells.size; ++p) {
      int index[3] = {cells.cell[0][p], cells.cell[1][p], cells.cell[2][p]};
      out.value[p][0] = tensor(index[0], index[1], index[2]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const DifferenceStencil d = differenceStencil(index[axis], sizes[axis]);
        const int centre = index[axis];
        float sum = 0.0f;
        for (int t = 0; t < 3; ++t) {
          index[axis] = d.index[t];
          sum += d.weight[t] * tensor(index[0], index[1], index[2]);
        }
        index[axis] = centre;
        out.value[p][axis + 1] = sum;
      }
    }
  }

  GridLocator grid;
  DenseTensor tensor;
};

DenseDistanceField::DenseDistanceField(DenseTensor tensor, const GridGeometry& geometry, SupportMask mask,
                                       Interpolation interpolation)
    : impl_(std::make_unique<Impl>(std::move(tensor), geometry, std::move(mask), interpolation)) {}
DenseDistanceField::~DenseDistanceField() = default;
const GridGeometry& DenseDistanceField::geometry() const { return impl_->grid.geometry(); }
std::size_t DenseDistanceField::memoryBytes() const {
  return impl_->tensor.size() * sizeof(float) + impl_->grid.mask().memoryBytes();
}
const DenseTensor& DenseDistanceField::tensor() const { return impl_->tensor; }

void DenseDistanceField::evaluate(const PointSpan& points, const SampleSpan& samples) const {
  const Impl& self = *impl_;
  const bool nearest = self.grid.interpolation() == Interpolation::kNearest;
  CellChunk cells;
  CornerChunk corners;
  StencilChunk stencils;
  for (int begin = 0; begin < points.size; begin += kChunk) {
    cells.size = std::min(kChunk, points.size - begin);
    self.grid.locate(points, begin, cells);
    if (nearest) {
      self.stencils(cells, stencils);
      self.grid.copy(cells, stencils, samples, begin);
    } else {
      self.corners(cells, corners);
      self.grid.interpolate(cells, corners, samples, begin);
    }
  }
}

}  // namespace ttsdf
