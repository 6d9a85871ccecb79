#include <utility>

#include "../build_steps/parallel.h"
#include "field_grid.h"
#include "surface_survey.h"
#include "ttsdf_localization/signed_field/sampled_field_methods.h"
#include "ttsdf_localization/signed_field/signed_distance.h"

namespace ttsdf {
SampledField sampleSurfaceDistance(const ObservedGrid& observed, const BuildOptions& options,
                                   const BuildProgress& progress) {
  const ProgressStep surface_step(progress, "surface");
  ObservedSurface surface = observedSurface(observed, kMinSurfacePiece, options.threads);
  if (surface.mesh.empty()) throwNoSurface();
  surface_step.report(0.8);
  const Eigen::Matrix3d R_map_grid =
      options.align_axes ? gridRotation(surface.mesh, &surface.normals) : Eigen::Matrix3d::Identity();

  SampledField field;
  field.geometry = gridAround(surface.mesh.vertices, R_map_grid, observed.voxel_size, options.margin);
  toIndexCoordinates(surface, field.geometry);

  const ProgressStep distance_step(progress, "distance");
  NearestSurfaceOptions nearest_options;
  nearest_options.threads = options.threads;
  nearest_options.exact_within = exactRange(options, observed.voxel_size);
  nearest_options.report = [&](double share) { distance_step.report(share); };
  const NearestSurface nearest = nearestSurface(surface.mesh, field.geometry.dims, nearest_options);

  const ProgressStep sign_step(progress, "sign");
  SignedDistanceOptions sign_options;
  sign_options.support_distance = options.support_distance;
  sign_options.clamp_negative = options.clamp_negative;
  sign_options.clamp_positive = options.clamp_positive;
  sign_options.credible_depth = observed.truncation + 1.5 * observed.voxel_size;
  sign_options.threads = options.threads;
  SignedDistance distance = signedDistance(readSides(observed, field.geometry, options.threads), surface,
                                           nearest, field.geometry, sign_options);
  sign_step.report(0.6);
  smoothUnknown(distance, observed.voxel_size, options.threads);
  if (options.support_mask)
    field.mask = supportMask(distance.supported, field.geometry.dims, kMaskCellVoxels);
  sign_step.report(1.0);
  field.values = std::move(distance.values);
  field.known = std::move(distance.known);
  return field;
}

}  // namespace ttsdf
