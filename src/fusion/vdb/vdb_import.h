#pragma once
// Grids made by others, brought onto the volume's lattice.

#include "ttsdf_localization/fusion/tsdf_volume_grids.h"

namespace ttsdf {

/// What a foreign grid of signed distances is.
enum class VdbSurface {
  kBroken,  ///< holds NaN
  kNone,    ///< no negative value: no surface
  kClosed,  ///< a narrow-band level set: inside and outside are known everywhere
  kOpen,    ///< a fused shell: what is not active is unknown
};
VdbSurface classifySurface(const openvdb::FloatGrid& grid);

/// Fills empty grids from a closed level set; the distances are rebuilt from its surface unless its lattice
/// and band already fit. Outside is marked free up to half the object's size around it.
void importClosed(const openvdb::FloatGrid& source, const FusionOptions& options, TsdfVolume::Grids& grids);

/// Fills empty grids from an open shell by trilinear interpolation between active samples; active samples at
/// the end of the band become free space. `options.truncation` must not exceed the source's background.
void importOpen(const openvdb::FloatGrid& source, const FusionOptions& options, TsdfVolume::Grids& grids);

}  // namespace ttsdf
