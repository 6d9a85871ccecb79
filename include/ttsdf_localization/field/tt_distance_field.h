#pragma once
// The compressed field, evaluated without decompressing it.
//
// For a pair (i, j) of first and middle index the column c_ij = G1(i, :) G2(:, j, :) (r2 numbers) is
// contracted once and kept; a value is then a dot product of length r2. Interpolating the columns and the
// last core equals interpolating the full array, so the trilinear value and gradient are exact in the TT
// domain. The columns live across iterations and scans within a memory bound.

#include <cstddef>
#include <memory>

#include "ttsdf_localization/field/distance_field.h"
#include "ttsdf_localization/field/support_mask.h"
#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {

struct TtFieldOptions {
  Interpolation interpolation = Interpolation::kTrilinear;
  double cache_megabytes = 16.0;  ///< bound on the contracted columns kept
  bool portable = false;          ///< use the portable kernel even where the CPU has wider instructions
};

class TtDistanceField final : public DistanceField {
 public:
  /// Throws std::invalid_argument if train, mask and geometry disagree.
  TtDistanceField(TensorTrain train, const GridGeometry& geometry, SupportMask mask = {},
                  TtFieldOptions options = {});
  ~TtDistanceField() override;

  const GridGeometry& geometry() const override;
  using DistanceField::evaluate;
  void evaluate(const PointSpan& points, const SampleSpan& samples) const override;
  std::size_t memoryBytes() const override;

  const TensorTrain& train() const;
  const SupportMask& mask() const;
  /// Bytes of contracted columns held now.
  std::size_t cacheBytes() const;
  /// Contracts every column ahead of the first scan, as far as the bound allows.
  void warmUp();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ttsdf
