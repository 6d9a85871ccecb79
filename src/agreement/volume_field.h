#pragma once
// A fused volume as registration asks it: trilinear in the band, unknown elsewhere. No copy of the volume is
// made.

#include "ttsdf_localization/field/distance_field.h"
#include "ttsdf_localization/fusion/tsdf_volume.h"

namespace ttsdf {

class VolumeField final : public DistanceField {
 public:
  /// Keeps a reference. Throws std::invalid_argument for a volume without surface.
  explicit VolumeField(const TsdfVolume& volume);

  const GridGeometry& geometry() const override { return geometry_; }
  using DistanceField::evaluate;
  void evaluate(const PointSpan& points, const SampleSpan& samples) const override;
  std::size_t memoryBytes() const override { return volume_.memoryBytes(); }

 private:
  const TsdfVolume& volume_;
  GridGeometry geometry_;  // the box of the band
};

}  // namespace ttsdf
