#pragma once
// What a map shows that another edition of it does not.

#include "ttsdf_localization/map/tt_sdf_map.h"

namespace ttsdf {

/// Shares of the surface's points, of the edition that has them.
struct MapChange {
  double removed = 0.0;  ///< surface before, free space now
  double added = 0.0;    ///< surface now, free space before
  double first = 0.0;    ///< surface now, unknown before
  double moved = 0.0;    ///< surface in both, displaced by three quarters of a voxel to two voxels
  double largest() const;
};

/// Both in the same frame. Decompresses both.
MapChange changeOf(const TtSdfMap& before, const TtSdfMap& after);

}  // namespace ttsdf
