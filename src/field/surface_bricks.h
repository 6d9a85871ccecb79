#pragma once
// Which bricks of a compressed field are worth their bytes: those that scans ask for, because the surface
// passes through them.

#include <functional>
#include <vector>

#include "column_cache.h"
#include "quantized_bricks.h"
#include "ttsdf_localization/field/support_mask.h"

namespace ttsdf {

/// Bricks with samples near the surface where the map knows something, the nearest first, as many as fit.
/// Throws Cancelled.
class SurfaceBricks {
 public:
  SurfaceBricks(const StoredCores& cores, const GridGeometry& geometry, const SupportMask& mask);

  /// Looks at the whole map coarsely and at what is near the surface in full. Uses the columns' cache.
  void find(ColumnCache& columns, const KeepGoing& keep_going);
  /// Bricks found.
  std::size_t count() const;
  /// The most important bricks, at most `most` of them, decoded.
  QuantizedBricks make(ColumnCache& columns, std::size_t most, const KeepGoing& keep_going) const;

 private:
  static constexpr int kClasses = 8;  ///< of distance, the last one is not kept

  bool supported(int a, int b, int c) const;
  int classOf(int a, int b, int c, const float* samples) const;
  Dims toArray(int i, int j, int k) const;
  template <class Visit>
  void forEachBrick(const KeepGoing& keep_going, const Visit& visit) const;

  const StoredCores& cores_;
  const GridGeometry& geometry_;
  const SupportMask& mask_;
  QuantizedBricks layout_;
  std::vector<std::uint8_t> class_;  // of every brick; 0: not near
};

}  // namespace ttsdf
