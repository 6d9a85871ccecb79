#pragma once
// What one depth image says about space, per pixel: the plane through the surface seen there, how far that
// can be trusted, up to where the ray is free and where the observed band behind the surface ends.

#include <vector>

#include "ttsdf_localization/frames/depth_image.h"
#include "ttsdf_localization/fusion/tsdf_volume.h"

namespace ttsdf {

/// Depths along the optical axis [m].
struct SurfacePixel {
  float nx = 0.0F, ny = 0.0F, nz = 0.0F;  ///< unit normal in the camera frame, pointing away from the camera
  float offset = 0.0F;      ///< plane's distance from the camera: signed distance = offset - n . p [m]
  float weight = 0.0F;      ///< 0: no surface to fuse here (no reading, grazing, discontinuity)
  float free_depth = 0.0F;  ///< the ray is free up to here; 0: nothing known
  float band_end = 0.0F;    ///< behind here nothing was observed; 0: no surface
};

struct SurfacePixels {
  int width = 0, height = 0;
  std::vector<SurfacePixel> pixels;  ///< row-major
  const SurfacePixel& at(int u, int v) const {
    return pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(u)];
  }
};

/// Runs on the calling TBB arena; the result does not depend on its threads.
///
/// Planes are fitted to inverse depth over windows of 3 x 3 or 5 x 5 pixels, about a voxel wide: inverse
/// depth is linear in the pixel for a plane, and its noise is uniform for a structured-light or stereo
/// camera. Distances to the plane instead of along the ray make the zero crossing and the band independent of
/// the angle of incidence. Weights fall with the sensor's noise at that depth, with the cosine of the angle
/// of incidence, and towards depth discontinuities where the sensor mixes foreground and background there.
/// The free depth is the least over the window, so that rays passing an edge do not carve it.
SurfacePixels surfacePixels(const DepthImage& image, const CameraIntrinsics& intrinsics,
                            const FusionOptions& options);

}  // namespace ttsdf
