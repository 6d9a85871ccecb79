#pragma once
// A triangle mesh as a volume, which can be cut into parts as fused frames are.

#include "ttsdf_localization/fusion/tsdf_volume.h"
#include "ttsdf_localization/tools/build_sources.h"

namespace ttsdf {

/// What perfect observation of the mesh would leave: distances within the truncation, free space in front of
/// its faces. Sheets without thickness inside of a closed mesh have no sign and are lost. Throws
/// std::runtime_error naming the file: one that cannot be read, an open mesh whose faces do not agree which
/// side is out.
TsdfVolume volumeFromMesh(const BuildArguments& a, Progress& progress);

}  // namespace ttsdf
