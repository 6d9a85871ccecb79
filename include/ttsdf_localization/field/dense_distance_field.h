#pragma once
// The uncompressed field: baseline of the measurements and oracle of the tests.

#include <memory>

#include "ttsdf_localization/field/distance_field.h"
#include "ttsdf_localization/field/support_mask.h"
#include "ttsdf_localization/tensor/dense_tensor.h"

namespace ttsdf {

class DenseDistanceField final : public DistanceField {
 public:
  /// Throws std::invalid_argument if tensor, mask and geometry disagree.
  DenseDistanceField(DenseTensor tensor, const GridGeometry& geometry, SupportMask mask = {},
                     Interpolation interpolation = Interpolation::kTrilinear);
  ~DenseDistanceField() override;

  const GridGeometry& geometry() const override;
  using DistanceField::evaluate;
  void evaluate(const PointSpan& points, const SampleSpan& samples) const override;
  std::size_t memoryBytes() const override;
  const DenseTensor& tensor() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ttsdf
