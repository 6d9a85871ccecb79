#include <cmath>
#include <stdexcept>

#include "../build_steps/parallel.h"
#include "sampled_field_tiles.h"
#include "ttsdf_localization/signed_field/sampled_field_methods.h"

namespace ttsdf {

namespace {

SampledField sampleRelativeToOrigin(const TsdfVolume& volume, const BuildOptions& options,
                                    const BuildProgress& progress) {
  if (needsTiles(volume, options)) return sampleSurfaceTiles(volume, options, progress);
  const ProgressStep read_step(progress, "read volume");
  // One voxel more than asked for: every crossing then has its four cells.
  const int margin = static_cast<int>(std::ceil(options.margin / volume.options().voxel_size)) + 2;
  const ObservedGrid observed = observedGrid(volume, margin, options.threads);
  read_step.report(1.0);
  if (options.field == "tsdf") return sampleTruncatedDistance(observed, options, progress);
  if (options.sdf_method != "surface") return sampleOccupancyDistance(observed, options, progress);
  return sampleSurfaceDistance(observed, options, progress);
}

}  // namespace

SampledField sampleField(const TsdfVolume& volume, const BuildOptions& options,
                         const BuildProgress& progress) {
  validate(options);
  SampledField field = sampleRelativeToOrigin(volume, options, progress);
  field.geometry.T_map_grid.translation() += volume.origin();
  return field;
}

}  // namespace ttsdf
