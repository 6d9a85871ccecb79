#include "depth_fusion.h"

#include <cmath>

#include "block_update.h"
#include "depth_pyramid.h"
#include "surface_pixels.h"
#include "view_blocks.h"

namespace ttsdf {

namespace {

/// The surface must go on at the foot of a voxel behind it, within a voxel and the noise of depth, which
/// grows with its square.
constexpr float kFootNoise = 0.0025F;   // [1/m]
constexpr float kFootMinCosine = 0.5F;  // between the normals

/// Looks voxels up in the image, in single precision relative to the camera.
class VoxelObserver {
 public:
  VoxelObserver(const SurfacePixels& pixels, const VoxelCamera& camera, const FusionOptions& options)
      : pixels_(pixels),
        camera_(camera),
        fx_(static_cast<float>(camera.k.fx)),
        fy_(static_cast<float>(camera.k.fy)),
        cx_(static_cast<float>(camera.k.cx) + 0.5F),
        cy_(static_cast<float>(camera.k.cy) + 0.5F),
        near_(static_cast<float>(camera.near_depth)),
        voxel_size_(static_cast<float>(options.voxel_size)),
        truncation_(static_cast<float>(options.truncation)) {}

  void observe(const openvdb::Coord& origin, BlockObservation& observation) const {
    const Eigen::Vector3f first = camera_.position(origin).cast<float>();
    const Eigen::Matrix3f axes = camera_.axes.cast<float>();
    openvdb::Index n = 0;
    for (int i = 0; i < kBlockSide; ++i) {
      for (int j = 0; j < kBlockSide; ++j) {
        const Eigen::Vector3f row =
            first + static_cast<float>(i) * axes.col(0) + static_cast<float>(j) * axes.col(1);
        for (int k = 0; k < kBlockSide; ++k, ++n)
          observeVoxel(row + static_cast<float>(k) * axes.col(2), n, observation);
      }
    }
  }

 private:
  /// The pixel a point of the camera frame falls on; none if it is outside of the view.
  const SurfacePixel* pixelOf(const Eigen::Vector3f& p) const {
    if (!(p.z() >= near_)) return nullptr;
    const float u = fx_ * p.x() / p.z() + cx_,
                v = fy_ * p.y() / p.z() + cy_;  // rounded to the nearest by truncation
    const bool inside = u >= 0.0F && v >= 0.0F && u < static_cast<float>(pixels_.width) &&
                        v < static_cast<float>(pixels_.height);
    return inside ? &pixels_.at(static_cast<int>(u), static_cast<int>(v)) : nullptr;
  }

  static float planeDistance(const SurfacePixel& pixel, const Eigen::Vector3f& p) {
    return pixel.offset - (pixel.nx * p.x() + pixel.ny * p.y() + pixel.nz * p.z());
  }

  /// Whether the surface was seen at the foot of a point behind it. A ray that meets a box near its edge
  /// leaves it through the other side: the air there lies behind the plane, but there is no surface above it.
  bool hasFoot(const SurfacePixel& pixel, const Eigen::Vector3f& p, float distance) const {
    const Eigen::Vector3f foot = p + distance * Eigen::Vector3f(pixel.nx, pixel.ny, pixel.nz);
    const SurfacePixel* seen = pixelOf(foot);
    if (!seen || !(seen->band_end > 0.0F)) return false;
    const float cosine = seen->nx * pixel.nx + seen->ny * pixel.ny + seen->nz * pixel.nz;
    return cosine >= kFootMinCosine &&
           std::abs(planeDistance(*seen, foot)) <= voxel_size_ + kFootNoise * foot.z() * foot.z();
  }

  void observeVoxel(const Eigen::Vector3f& p, openvdb::Index n, BlockObservation& observation) const {
    const SurfacePixel* pixel = pixelOf(p);
    if (!pixel) return;
    if (p.z() <= pixel->free_depth) {
      observation.free.setOn(n);
      return;
    }
    if (!(p.z() <= pixel->band_end)) return;
    const float distance = planeDistance(*pixel, p);
    if (!(distance >= -truncation_ && distance <= truncation_)) return;
    if (distance < 0.0F && !hasFoot(*pixel, p, distance)) return;
    observation.distance[n] = distance;
    observation.weight[n] = pixel->weight * bandWeight(distance, voxel_size_, truncation_);
    observation.has_band = true;
  }

  const SurfacePixels& pixels_;
  const VoxelCamera& camera_;
  float fx_, fy_, cx_, cy_, near_, voxel_size_, truncation_;
};

}  // namespace

void fuseDepthImage(TsdfVolume::Grids& grids, const FusionOptions& options, const DepthImage& image,
                    const CameraIntrinsics& intrinsics, const Eigen::Isometry3d& T_map_camera) {
  const SurfacePixels pixels = surfacePixels(image, intrinsics, options);
  const DepthPyramid pyramid(pixels);
  const VoxelCamera camera(intrinsics, T_map_camera, options.voxel_size);
  const std::vector<BlockVisit> visits = blocksInView(camera, pyramid, options.carve);
  const VoxelObserver observer(pixels, camera, options);
  updateBlocks(grids, options, visits, [&](std::size_t index, BlockObservation& observation) {
    observer.observe(visits[index].origin, observation);
  });
}

}  // namespace ttsdf
