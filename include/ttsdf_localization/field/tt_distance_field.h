#pragma once
// The compressed field, evaluated without decompressing it.
//
// For a pair (i, j) of first and middle index the column c_ij = G1(i, :) G2(:, j, :) (r2 numbers) is
// contracted once and kept for a while; a sample is then a dot product of length r2. Interpolating samples
// equals interpolating the cores, so the trilinear value and gradient are exact in the TT domain.
// Registration asks again and again around the same surfaces: as far as the memory allows, samples around the
// surface are kept as bytes in small bricks, and a point there costs what it costs in the uncompressed array.

#include <cstddef>
#include <memory>

#include "ttsdf_localization/field/distance_field.h"
#include "ttsdf_localization/field/support_mask.h"
#include "ttsdf_localization/tensor/tensor_train.h"

namespace ttsdf {

struct TtFieldOptions {
  Interpolation interpolation = Interpolation::kTrilinear;
  /// Everything that the map takes: cores, mask, columns, bricks, and the far field of registration, for
  /// which room is left. Cores, mask, far field and what one scan works with are always there. It changes
  /// the time that scans take, not their poses.
  double memory_megabytes = 4.0;
};

/// Where the bytes are.
struct FieldMemory {
  std::size_t cores = 0, mask = 0, columns = 0, bricks = 0;
  std::size_t total() const { return cores + mask + columns + bricks; }
};

class TtDistanceField final : public DistanceField {
 public:
  /// Throws std::invalid_argument if train, mask and geometry disagree or an option is out of range.
  TtDistanceField(const TensorTrain& train, const GridGeometry& geometry, SupportMask mask = {},
                  TtFieldOptions options = {});
  ~TtDistanceField() override;

  const GridGeometry& geometry() const override;
  using DistanceField::evaluate;
  void evaluate(const PointSpan& points, const SampleSpan& samples) const override;
  /// Once warm, bricks answer near the surface, and the far field everywhere else: the cores are asked for
  /// bricks only.
  void evaluate(const PointSpan& points, const DistanceField& far, const SampleSpan& samples) const override;
  std::size_t memoryBytes() const override;
  FieldMemory memory() const;

  int rank1() const;
  int rank2() const;
  /// Extents in chain order.
  std::array<int, 3> modeSizes() const;
  const SupportMask& mask() const;
  /// Makes the bricks around the surface, as far as the memory allows; once. Until then every point is asked
  /// of the cores. Cost: the parts of the map near the surface, about 3 us per brick of 7^3 cells.
  void warmUp(const KeepGoing& keep_going = {}) const override;
  void prepare(const PointSpan& points) const override;
  std::array<int, 3> walkOrder() const override;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ttsdf
