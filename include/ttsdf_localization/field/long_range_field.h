#pragma once
// The far field, made again when a map is loaded: a map stores distances exactly near the surface and clamps
// them further out (that is where the bytes go), and a coarse grid of distances to the surface that the map
// itself describes pulls scans in from metres away.
//
// The grid covers the map's box and no more, a byte a sample. Outside of it the nearest surface point of the
// nearest place of the box is taken for the nearest one: the distance goes on, and so does its sign.

#include <functional>
#include <memory>

#include "ttsdf_localization/field/distance_field.h"

namespace ttsdf {

struct LongRangeOptions {
  int spacing_voxels = 4;              ///< grid spacing in voxels of the map, at least 1
  std::size_t max_samples = 1u << 20;  ///< the spacing grows until the coarse grid has at most so many
};

class LongRangeField final : public DistanceField {
 public:
  /// |value| = distance to the nearest foot point of the field's zero level [m], to about a voxel of the map,
  /// with the field's sign. Null if the field shows no surface. `keep_going` is asked now and then; false:
  /// Cancelled. Cost: about 1 us per coarse sample and per surface voxel.
  static std::shared_ptr<const LongRangeField> make(const DistanceField& field,
                                                    const LongRangeOptions& options,
                                                    const KeepGoing& keep_going);
  ~LongRangeField() override;

  /// Of the coarse grid: the map's box, rounded up to whole cells.
  const GridGeometry& geometry() const override;
  using DistanceField::evaluate;
  /// Everywhere valid up to the box's diagonal outside of it: the field says where to go, not whether the map
  /// knows the place.
  void evaluate(const PointSpan& points, const SampleSpan& samples) const override;
  std::size_t memoryBytes() const override;
  /// Of the far field of a map [bytes].
  static std::size_t bytesFor(const GridGeometry& map, const LongRangeOptions& options = {});

 private:
  class Impl;
  explicit LongRangeField(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// LongRangeField::make.
std::shared_ptr<const DistanceField> makeLongRangeField(const DistanceField& field,
                                                        const LongRangeOptions& options = {},
                                                        const KeepGoing& keep_going = {});

}  // namespace ttsdf
