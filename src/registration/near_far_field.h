#pragma once
// The map as registration asks it: near the surfaces the field itself, further away its far field.

#include <memory>

#include "ttsdf_localization/field/distance_field.h"

namespace ttsdf {

class NearFarField final : public DistanceField {
 public:
  NearFarField(std::shared_ptr<const DistanceField> field, std::shared_ptr<const DistanceField> far)
      : field_(std::move(field)), far_(std::move(far)) {
    setAgreement(field_->agreement());
  }

  const GridGeometry& geometry() const override { return field_->geometry(); }
  using DistanceField::evaluate;
  void evaluate(const PointSpan& points, const SampleSpan& samples) const override {
    field_->evaluate(points, *far_, samples);
  }
  std::size_t memoryBytes() const override { return field_->memoryBytes() + far_->memoryBytes(); }
  void prepare(const PointSpan& points) const override { field_->prepare(points); }

 private:
  std::shared_ptr<const DistanceField> field_, far_;
};

}  // namespace ttsdf
