#include "ttsdf_localization/field/dense_distance_field.h"

#include <sstream>
#include <stdexcept>

#include "grid_field.h"

namespace ttsdf {

class DenseDistanceField::Impl final : public GridField {
 public:
  Impl(DenseTensor tensor, const GridGeometry& geometry, SupportMask mask, Interpolation interpolation)
      : GridField(geometry, std::move(mask), interpolation, ModeOrder{{0, 1, 2}}),
        tensor_(std::move(tensor)) {
    if ((tensor_.dims() == geometry.dims).all()) return;
    std::ostringstream text;
    text << "dense field: got a tensor of " << tensor_.dims().transpose() << ", wanted "
         << geometry.dims.transpose();
    throw std::invalid_argument(text.str());
  }

  std::size_t memoryBytes() const override {
    return tensor_.size() * sizeof(float) + GridField::mask().memoryBytes();
  }
  const DenseTensor& tensor() const { return tensor_; }

 protected:
  void corners(const CellChunk& cells, CornerChunk& out) const override {
    const auto& n = chainSizes();
    const std::size_t da = n[0] > 1 ? 1 : 0;
    const std::size_t db = n[1] > 1 ? tensor_.offset(0, 1, 0) : 0;
    const std::size_t dc = n[2] > 1 ? tensor_.offset(0, 0, 1) : 0;
    for (int p = 0; p < cells.size; ++p) {
      const float* const s =
          tensor_.data() + tensor_.offset(cells.cell[0][p], cells.cell[1][p], cells.cell[2][p]);
      float* const v = out.value[p];
      v[0] = s[0], v[1] = s[da], v[2] = s[db], v[3] = s[da + db];
      v[4] = s[dc], v[5] = s[da + dc], v[6] = s[db + dc], v[7] = s[da + db + dc];
    }
  }

  void stencils(const CellChunk& cells, StencilChunk& out) const override {
    const auto& sizes = chainSizes();
    for (int p = 0; p < cells.size; ++p) {
      int index[3] = {cells.cell[0][p], cells.cell[1][p], cells.cell[2][p]};
      out.value[p][0] = tensor_(index[0], index[1], index[2]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const DifferenceStencil d = differenceStencil(index[axis], sizes[axis]);
        const int centre = index[axis];
        float sum = 0.0f;
        for (int t = 0; t < 3; ++t) {
          index[axis] = d.index[t];
          sum += d.weight[t] * tensor_(index[0], index[1], index[2]);
        }
        index[axis] = centre;
        out.value[p][axis + 1] = sum;
      }
    }
  }

 private:
  DenseTensor tensor_;
};

DenseDistanceField::DenseDistanceField(DenseTensor tensor, const GridGeometry& geometry, SupportMask mask,
                                       Interpolation interpolation)
    : impl_(std::make_unique<Impl>(std::move(tensor), geometry, std::move(mask), interpolation)) {}
DenseDistanceField::~DenseDistanceField() = default;
const GridGeometry& DenseDistanceField::geometry() const { return impl_->geometry(); }
void DenseDistanceField::evaluate(const PointSpan& points, const SampleSpan& samples) const {
  impl_->evaluate(points, samples);
}
std::size_t DenseDistanceField::memoryBytes() const { return impl_->memoryBytes(); }
const DenseTensor& DenseDistanceField::tensor() const { return impl_->tensor(); }

}  // namespace ttsdf
