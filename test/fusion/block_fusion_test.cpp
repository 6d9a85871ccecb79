// The block-wise short cuts against their definitions, voxel by voxel.

#include <gtest/gtest.h>

#include <random>

#include "../../src/fusion/depth/depth_pyramid.h"
#include "../../src/fusion/depth/surface_guard.h"
#include "../../src/fusion/depth/surface_pixels.h"
#include "../support/rendered_scene.h"
#include "../support/volume_probe.h"

namespace ttsdf {
namespace {

using testing::camera;
using testing::lookAt;
using testing::render;
using testing::Scene;

TEST(SurfaceGuard, EqualsBruteForceOverTheNeighbourhood) {
  std::mt19937 random(5);
  for (const int radius : {1, 2, 3, 4}) {
    openvdb::FloatTree tsdf(0.06F);
    std::uniform_int_distribution<int> place(-12, 19), sign(0, 1);
    for (int i = 0; i < 12 * radius; ++i) {
      tsdf.setValueOn({place(random), place(random), place(random)}, sign(random) ? -0.01F : 0.02F);
    }
    tsdf.addTile(1, {8, 8, 8}, -0.06F, false);  // interior of a closed solid
    const BlockMask mask = nearNegative(tsdf, {0, 0, 0}, radius);
    for (int x = 0; x < 8; ++x) {
      for (int y = 0; y < 8; ++y) {
        for (int z = 0; z < 8; ++z) {
          bool near = false;
          for (int dx = -radius; dx <= radius; ++dx) {
            for (int dy = -radius; dy <= radius; ++dy) {
              for (int dz = -radius; dz <= radius; ++dz)
                near = near || tsdf.getValue({x + dx, y + dy, z + dz}) < 0.0F;
            }
          }
          ASSERT_EQ(mask.isOn(FloatLeaf::coordToOffset({x, y, z})), near) << openvdb::Coord(x, y, z);
        }
      }
    }
  }
}

TEST(DepthPyramid, IsConservativeAndNotMuchWider) {
  SurfacePixels image;
  image.width = 101, image.height = 67;
  std::mt19937 random(9);
  std::uniform_real_distribution<float> depth(0.5F, 4.0F);
  for (int i = 0; i < image.width * image.height; ++i) {
    SurfacePixel pixel;
    pixel.free_depth = depth(random), pixel.band_end = pixel.free_depth + 0.1F;
    image.pixels.push_back(pixel);
  }
  const DepthPyramid pyramid(image);
  const auto bruteForce = [&image](int u0, int u1, int v0, int v1) {
    DepthRange range{1e9F, 0.0F};
    for (int v = std::max(v0, 0); v <= std::min(v1, image.height - 1); ++v) {
      for (int u = std::max(u0, 0); u <= std::min(u1, image.width - 1); ++u) {
        range.min_free = std::min(range.min_free, image.at(u, v).free_depth);
        range.max_reach = std::max(range.max_reach, image.at(u, v).band_end);
      }
    }
    return range;
  };
  std::uniform_int_distribution<int> column(0, 100), row(0, 66);
  for (int i = 0; i < 2000; ++i) {
    const auto u = std::minmax({column(random), column(random)}), v = std::minmax({row(random), row(random)});
    const DepthRange got = pyramid.range(u.first, u.second, v.first, v.second);
    const DepthRange inner = bruteForce(u.first, u.second, v.first, v.second);
    const int slack = std::max({4, (u.second - u.first) / 2, (v.second - v.first) / 2});
    const DepthRange outer = bruteForce(u.first - slack, u.second + slack, v.first - slack, v.second + slack);
    ASSERT_LE(got.min_free, inner.min_free);
    ASSERT_GE(got.max_reach, inner.max_reach);
    ASSERT_GE(got.min_free, outer.min_free);
    ASSERT_LE(got.max_reach, outer.max_reach);
  }
  EXPECT_EQ(pyramid.maxReach(), bruteForce(0, 100, 0, 66).max_reach);
}

TEST(BlockFusion, FreeVoxelsAreThoseThatTheirOwnPixelSaysAreFree) {
  // A scene with holes, edges and the border of the view inside of blocks.
  const Scene scene = Scene().room({0, 0, 0}, {3, 3, 2.5}).box({1.0, 0.8, 0.0}, {1.4, 1.2, 1.1});
  const auto pose = lookAt({2.3, 2.1, 1.3}, {0.9, 0.7, 0.8});
  const CameraIntrinsics k = camera();
  DepthImage image = render(scene, k, pose);
  for (int v = 100; v < 130; ++v) {
    for (int u = 50; u < 90; ++u) image.depth[static_cast<std::size_t>(v * k.width + u)] = 0.0F;
  }
  TsdfVolume volume;
  volume.integrate(image, k, pose);

  const SurfacePixels pixels = surfacePixels(image, k, volume.options());
  const VoxelReader reader(volume.grids());
  const auto free = volume.grids().free->getConstAccessor();
  int free_count = 0;
  for (int x = -20; x <= 170; ++x) {
    for (int y = -20; y <= 170; ++y) {
      for (int z = -20; z <= 140; ++z) {
        const openvdb::Coord ijk(x, y, z);
        const Eigen::Vector3d p = pose.inverse() * testing::worldPosition(volume, ijk);
        const double u = k.fx * p.x() / p.z() + k.cx + 0.5, v = k.fy * p.y() / p.z() + k.cy + 0.5;
        if (p.z() < volume.options().voxel_size + 1e-5 || u < 0.0 || v < 0.0 || u >= k.width ||
            v >= k.height) {
          const bool too_near = p.z() < volume.options().voxel_size - 1e-5;
          ASSERT_FALSE(too_near && free.isValueOn(ijk)) << ijk;
          continue;
        }
        // A voxel on the border between pixels may round to either.
        if (std::abs(u - std::round(u)) < 1e-3 || std::abs(v - std::round(v)) < 1e-3) continue;
        const SurfacePixel& pixel = pixels.at(static_cast<int>(u), static_cast<int>(v));
        if (std::abs(p.z() - pixel.free_depth) < 1e-5) continue;
        ASSERT_EQ(free.isValueOn(ijk), p.z() <= pixel.free_depth) << ijk;
        free_count += free.isValueOn(ijk);
      }
    }
  }
  EXPECT_GT(free_count, 100000);
}

}  // namespace
}  // namespace ttsdf
