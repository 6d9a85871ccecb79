#pragma once

#include <memory>

#include "atlas_members.h"

namespace ttsdf {

class AtlasField::Far final : public DistanceField {
 public:
  /// At least one map must have a far field.
  explicit Far(std::shared_ptr<const Members> members);

  const GridGeometry& geometry() const override { return geometry_; }
  void evaluate(const PointSpan& points, const SampleSpan& samples) const override;
  std::size_t memoryBytes() const override;

 private:
  void evaluatePiece(const PointSpan& points, const SampleSpan& samples, int begin, int size) const;

  std::shared_ptr<const Members> members_;
  GridGeometry geometry_;  ///< the atlas field's box with the coarsest spacing of the maps
};

}  // namespace ttsdf
