#pragma once
// A part of an atlas field that global localization begins in: starts lie around some of its maps, and scans
// are compared with all of them, so that a scan over a border is explained as a whole.

#include <memory>

#include "ttsdf_localization/atlas/atlas_field.h"

namespace ttsdf {

class SearchWindow final : public DistanceField {
 public:
  /// The window is the box of the field's first `maps` maps (at least one).
  SearchWindow(std::shared_ptr<const AtlasField> field, std::size_t maps);

  const GridGeometry& geometry() const override { return geometry_; }
  void evaluate(const PointSpan& points, const SampleSpan& samples) const override {
    field_->evaluate(points, samples);
  }
  std::size_t memoryBytes() const override { return field_->memoryBytes(); }
  void prepare(const PointSpan& points) const override { field_->prepare(points); }

 private:
  std::shared_ptr<const AtlasField> field_;
  GridGeometry geometry_;  ///< with the field's origin: points mean the same to both
};

}  // namespace ttsdf
