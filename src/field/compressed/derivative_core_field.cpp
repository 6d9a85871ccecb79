#include "ttsdf_localization/field/derivative_core_field.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "../grid_locator.h"

namespace ttsdf {

namespace {

const TensorTrain& matchingTrain(const TensorTrain& train, const Dims& dims) {
  if (train.rank1() > 0 && (train.dims() == dims).all()) return train;
  std::ostringstream text;
  text << "derivative cores: got a train of " << train.dims().transpose() << ", wanted " << dims.transpose();
  throw std::invalid_argument(text.str());
}

}  // namespace

class DerivativeCoreField::Impl {
 public:
  Impl(TensorTrain tt, const GridGeometry& geometry, SupportMask mask)
      : grid(geometry, std::move(mask), Interpolation::kNearest, tt.axes()), train(std::move(tt)) {
    matchingTrain(train, geometry.dims);
    const ModeOrder& axes = train.axes();
    first = differentiate(train, axes[0], 1.0).first();
    middle = differentiate(train, axes[1], 1.0).middle();
    last = differentiate(train, axes[2], 1.0).last();
  }

  void stencils(const CellChunk& cells, StencilChunk& out) const {
    const Eigen::Index r2 = train.rank2();
    Eigen::RowVectorXf row;  // G1(i, :) G2(:, j, :)
    for (int p = 0; p < cells.size; ++p) {
      const Eigen::Index i = cells.cell[0][p], j = cells.cell[1][p], k = cells.cell[2][p];
      const auto g1 = train.first().row(i);
      const auto g3 = train.last().col(k);
      row.noalias() = g1 * train.middle().middleCols(j * r2, r2);
      out.value[p][0] = row.dot(g3);
      out.value[p][3] = row.dot(last.col(k));
      row.noalias() = g1 * middle.middleCols(j * r2, r2);
      out.value[p][2] = row.dot(g3);
      row.noalias() = first.row(i) * train.middle().middleCols(j * r2, r2);
      out.value[p][1] = row.dot(g3);
    }
  }

  GridLocator grid;
  TensorTrain train;
  Eigen::MatrixXf first, middle, last;  // derivatives [1/voxel]
};

DerivativeCoreField::DerivativeCoreField(TensorTrain train, const GridGeometry& geometry, SupportMask mask)
    : impl_(std::make_unique<Impl>(std::move(train), geometry, std::move(mask))) {}
DerivativeCoreField::~DerivativeCoreField() = default;
const GridGeometry& DerivativeCoreField::geometry() const { return impl_->grid.geometry(); }
const TensorTrain& DerivativeCoreField::train() const { return impl_->train; }
std::size_t DerivativeCoreField::memoryBytes() const {
  return 2 * impl_->train.memoryBytes() + impl_->grid.mask().memoryBytes();
}

void DerivativeCoreField::evaluate(const PointSpan& points, const SampleSpan& samples) const {
  CellChunk cells;
  StencilChunk stencils;
  for (int begin = 0; begin < points.size; begin += kChunk) {
    cells.size = std::min(kChunk, points.size - begin);
    impl_->grid.locate(points, begin, cells);
    impl_->stencils(cells, stencils);
    impl_->grid.copy(cells, stencils, samples, begin);
  }
}

}  // namespace ttsdf
