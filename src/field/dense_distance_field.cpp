#include "ttsdf_localization/field/dense_distance_field.h"

#include <sstream>
#include <stdexcept>

#include "grid_evaluation.h"

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
    const auto sample = [this](int a, int b, int c) { return tensor(a, b, c); };
    fillStencils(grid, cells, sample, out);
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
  evaluateOnGrid(*impl_, points, samples);
}

}  // namespace ttsdf
