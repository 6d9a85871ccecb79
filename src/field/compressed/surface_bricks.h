#pragma once
// Which bricks of a compressed field are worth their bytes: those that scans ask for, because the surface
// passes through them.

#include "column_cache.h"
#include "quantized_bricks.h"
#include "ttsdf_localization/field/support_mask.h"

namespace ttsdf {

/// Bricks with samples near the surface where the map knows something.
class SurfaceBricks {
 public:
  SurfaceBricks(const StoredCores& cores, const GridGeometry& geometry, const SupportMask& mask);

  /// Looks at the whole map coarsely and at what is near the surface in full. At most `most` bricks: a whole
  /// set, ready to be read; more: which there are, nothing is allocated. Throws Cancelled.
  QuantizedBricks find(ColumnCache& columns, std::size_t most, const KeepGoing& keep_going) const;

 private:
  bool supported(int a, int b, int c) const;
  bool nearSurface(int a, int b, int c, const float* samples) const;
  Dims toArray(int i, int j, int k) const;

  const StoredCores& cores_;
  const GridGeometry& geometry_;
  const SupportMask& mask_;
  std::array<int, 3> counts_;
};

}  // namespace ttsdf
