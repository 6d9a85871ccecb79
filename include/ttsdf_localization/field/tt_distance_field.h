#pragma once
// The compressed field, evaluated without decompressing it.
//
// For a pair (i, j) of first and middle index the column c_ij = G1(i, :) G2(:, j, :) (r2 numbers) is
// contracted once and kept; a sample is then a dot product of length r2. Interpolating samples equals
// interpolating the cores, so the trilinear value and gradient are exact in the TT domain. Registration asks
// again and again around the same surfaces: samples are kept in small bricks across iterations and scans,
// within a memory bound, and a point then costs what it costs in the uncompressed array.

#include <cstddef>
#include <memory>

#include "ttsdf_localization/field/distance_field.h"
#include "ttsdf_localization/field/support_mask.h"
#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {

struct TtFieldOptions {
  Interpolation interpolation = Interpolation::kTrilinear;
  /// Bound on the contracted columns and bricks kept; a block of each and 4 B per brick are always there.
  double cache_megabytes = 24.0;
  bool portable = false;  ///< use the portable kernel even where the CPU has wider instructions
};

class TtDistanceField final : public DistanceField {
 public:
  /// Throws std::invalid_argument if train, mask and geometry disagree or an option is out of range.
  TtDistanceField(TensorTrain train, const GridGeometry& geometry, SupportMask mask = {},
                  TtFieldOptions options = {});
  ~TtDistanceField() override;

  const GridGeometry& geometry() const override;
  using DistanceField::evaluate;
  void evaluate(const PointSpan& points, const SampleSpan& samples) const override;
  std::size_t memoryBytes() const override;

  const TensorTrain& train() const;
  const SupportMask& mask() const;
  /// Bytes of contracted columns and bricks held now, book-keeping included.
  std::size_t cacheBytes() const;
  /// Makes the bricks around the surface ahead of the first scan, as far as the bound allows. Decodes the
  /// whole map, and what it keeps once more: about 0.3 s for 8 million voxels.
  void warmUp() const override;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ttsdf
