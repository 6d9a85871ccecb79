#pragma once
// From unsigned distances to a signed field that says where it knows: the steps of sampleField's method
// "surface". Distances in voxels of the grid here; metres only in the result.

#include <cstdint>
#include <vector>

#include "ttsdf_localization/field/grid_geometry.h"
#include "ttsdf_localization/field/support_mask.h"
#include "ttsdf_localization/surface/nearest_surface.h"
#include "ttsdf_localization/surface/observed_sides.h"
#include "ttsdf_localization/surface/observed_surface.h"
#include "ttsdf_localization/tensor/dense_tensor.h"

namespace ttsdf {

/// The surface as one sample sees it.
struct SurfaceView {
  Eigen::Vector3f foot;    ///< nearest surface point, index coordinates
  float along = 0.0F;      ///< n . (x - foot), n the smoothed normal at the foot [voxel]
  float sideways = 0.0F;   ///< length of the rest of x - foot [voxel]
  bool at_border = false;  ///< the foot lies where the observed surface ends
};

/// Reads `nearest` with the surface it was made from (index coordinates of the sampled grid).
SurfaceView viewSurface(const ObservedSurface& surface, std::int32_t triangle, const Eigen::Vector3f& index);

struct SignedDistanceOptions {
  double support_distance = 0.04;                     ///< [m]
  double clamp_negative = 0.0, clamp_positive = 0.0;  ///< [m]; 0: not clamped
  double credible_depth = 0.0;  ///< matter further than this from the surface kept is noise: unknown [m]
  int threads = 2;
};

struct SignedDistance {
  DenseTensor values;                   ///< [m]
  std::vector<std::uint8_t> known;      ///< some ray saw it
  std::vector<std::uint8_t> supported;  ///< the value means something
};

/// Sign and support of every sample, of which `sides` are known. `surface` in index coordinates of
/// `geometry`. Samples without a triangle (NearestSurfaceOptions::none_beyond) need both clamps: they are
/// free space at the positive one, or unknown.
SignedDistance signedDistance(std::vector<SideReading> sides, const ObservedSurface& surface,
                              const NearestSurface& nearest, const GridGeometry& geometry,
                              const SignedDistanceOptions& options);

/// 1 for values that mean nothing: neither known nor supported, or near a jump of the sign far from any
/// surface, which also loses its support.
std::vector<std::uint8_t> looseSamples(SignedDistance& field, double voxel_size, int threads);

/// Gives values that mean nothing (neither known nor supported) a smooth course, and takes support from
/// unknown samples where the sign jumps far from any surface. Known samples keep their values.
void smoothUnknown(SignedDistance& field, double voxel_size, int threads);

/// One bit per cell of `cell_voxels`^3 samples: at least half of them supported.
SupportMask supportMask(const std::vector<std::uint8_t>& supported, const Dims& dims, int cell_voxels);

}  // namespace ttsdf
