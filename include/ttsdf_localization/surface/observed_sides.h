#pragma once
// What rays said at the samples of another grid than the one they were fused in.

#include <cstdint>
#include <vector>

#include "ttsdf_localization/field/grid_geometry.h"
#include "ttsdf_localization/surface/observed_grid.h"

namespace ttsdf {

/// What rays said about one place of the map.
enum class Side : std::uint8_t { kUnknown, kFree, kMatter };

struct SideReading {
  SideReading() : SideReading(Side::kUnknown, false) {}
  SideReading(Side nearest, bool is_exact) : side(nearest), exact(is_exact) {}
  Side side : 7;   ///< of the nearest observed sample
  bool exact : 1;  ///< it is the sample itself: right even next to the surface
};
static_assert(sizeof(SideReading) == 1, "there is one per sample");

/// One reading per sample of `geometry`, first index fastest; unknown outside `observed`.
std::vector<SideReading> readSides(const ObservedGrid& observed, const GridGeometry& geometry, int threads);

}  // namespace ttsdf
