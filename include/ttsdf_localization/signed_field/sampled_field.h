#pragma once
// The uncompressed signed field of a fused volume: what compression starts from.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "ttsdf_localization/build_steps/build_options.h"
#include "ttsdf_localization/field/frame_agreement.h"
#include "ttsdf_localization/field/grid_geometry.h"
#include "ttsdf_localization/field/support_mask.h"
#include "ttsdf_localization/fusion/tsdf_volume.h"
#include "ttsdf_localization/tensor/dense_tensor.h"

namespace ttsdf {

class FieldBricks;

/// The uncompressed signed field that compression starts from (and that baselines use).
struct SampledField {
  DenseTensor values;  ///< [m]
  std::vector<std::uint8_t>
      known;  ///< per voxel: 1 where some ray saw it (free or band); same order as values
  /// In place of values and known (then empty) on grids whose dense arrays would be too large; made by tiles.
  std::shared_ptr<const FieldBricks> bricks;
  GridGeometry geometry;
  SupportMask mask;
  std::string frame_id = "map";  ///< the map's frame
  FrameAgreement agreement;      ///< of the frames it was made of
};

/// Signed distance over the volume's box as the options say. Throws std::runtime_error if nothing was
/// observed.
SampledField sampleField(const TsdfVolume& volume, const BuildOptions& options,
                         const BuildProgress& progress = {});

}  // namespace ttsdf
