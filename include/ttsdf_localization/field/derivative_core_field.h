#pragma once
// The compressed field as the paper evaluates it: at the nearest voxel, the value from the cores and each
// partial derivative from cores of its own (section IV-A, Proposition). Float cores, nothing decoded, nothing
// kept. The baseline of the measurements; TtDistanceField is what robots use.

#include <memory>

#include "ttsdf_localization/field/distance_field.h"
#include "ttsdf_localization/field/support_mask.h"
#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {

class DerivativeCoreField final : public DistanceField {
 public:
  /// Throws std::invalid_argument if train, mask and geometry disagree.
  DerivativeCoreField(TensorTrain train, const GridGeometry& geometry, SupportMask mask = {});
  ~DerivativeCoreField() override;

  const GridGeometry& geometry() const override;
  using DistanceField::evaluate;
  /// Cost per point: 3 r1 r2 multiplications.
  void evaluate(const PointSpan& points, const SampleSpan& samples) const override;
  /// Cores, the three derivative cores and the mask. The derivative along one mode changes one core only, so
  /// this is twice the cores.
  std::size_t memoryBytes() const override;

  const TensorTrain& train() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ttsdf
