#include "view_blocks.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace ttsdf {

namespace {

constexpr int kCoarseSide = 64;       // voxels; the subdivision starts here, or with larger cubes
constexpr double kMaxCubesDeep = 16;  // cubes from the camera to the end of its reach, about

enum class Coverage { kNothing, kFree, kMixed };

class ViewDivider {
 public:
  ViewDivider(const VoxelCamera& camera, const DepthPyramid& pyramid, bool carve)
      : camera_(camera), pyramid_(pyramid), carve_(carve) {}

  /// Appends the leaf-sized blocks of a cube of voxels.
  void divide(const openvdb::Coord& origin, int side, std::vector<BlockVisit>& out) const {
    const Coverage coverage = classify(origin, side);
    if (coverage == Coverage::kNothing || (coverage == Coverage::kFree && !carve_)) return;
    if (coverage == Coverage::kFree) {
      appendFree(origin, side, out);
    } else if (side == kBlockSide) {
      out.push_back({origin, false, 1.0F});
    } else {
      const int half = side / 2;
      for (int octant = 0; octant < 8; ++octant) {
        divide(origin.offsetBy((octant >> 2) * half, ((octant >> 1) & 1) * half, (octant & 1) * half), half,
               out);
      }
    }
  }

 private:
  static void appendFree(const openvdb::Coord& origin, int side, std::vector<BlockVisit>& out) {
    for (int x = 0; x < side; x += kBlockSide) {
      for (int y = 0; y < side; y += kBlockSide) {
        for (int z = 0; z < side; z += kBlockSide) out.push_back({origin.offsetBy(x, y, z), true, 1.0F});
      }
    }
  }

  Coverage classify(const openvdb::Coord& origin, int side) const {
    const Eigen::Vector3d first = camera_.position(origin);
    const double extent = side - 1;
    double z_min = first.z(), z_max = first.z();
    for (int axis = 0; axis < 3; ++axis) {
      const double step = extent * camera_.axes(2, axis);
      (step < 0.0 ? z_min : z_max) += step;
    }
    if (z_max < camera_.near_depth || z_min > pyramid_.maxReach()) return Coverage::kNothing;
    if (z_min < camera_.near_depth) return Coverage::kMixed;  // has no bounded projection

    double u_min = 1e9, u_max = -1e9, v_min = 1e9, v_max = -1e9;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d p =
          first + camera_.axes * (extent * Eigen::Vector3d(corner >> 2, (corner >> 1) & 1, corner & 1));
      const double u = camera_.k.fx * p.x() / p.z() + camera_.k.cx,
                   v = camera_.k.fy * p.y() / p.z() + camera_.k.cy;
      u_min = std::min(u_min, u), u_max = std::max(u_max, u), v_min = std::min(v_min, v),
      v_max = std::max(v_max, v);
    }
    // Pixels that voxels of the block can round to, one more on each side for rounding errors.
    const double width = camera_.k.width, height = camera_.k.height;
    if (u_max < -1.0 || u_min > width || v_max < -1.0 || v_min > height) return Coverage::kNothing;
    const bool inside = u_min >= 0.0 && u_max <= width - 1.0 && v_min >= 0.0 && v_max <= height - 1.0;
    const DepthRange range = pyramid_.range(pixel(u_min - 1.0, width), pixel(u_max + 1.0, width),
                                            pixel(v_min - 1.0, height), pixel(v_max + 1.0, height));
    if (z_min > range.max_reach) return Coverage::kNothing;
    return inside && z_max <= range.min_free ? Coverage::kFree : Coverage::kMixed;
  }

  static int pixel(double coordinate, double extent) {
    return static_cast<int>(std::clamp(std::floor(coordinate + 0.5), 0.0, extent - 1.0));
  }

  const VoxelCamera& camera_;
  const DepthPyramid& pyramid_;
  bool carve_;
};

/// Side of the cubes to start with [voxel].
int coarseSide(double reach, double voxel_size) {
  int side = kCoarseSide;
  while (reach / (side * voxel_size) > kMaxCubesDeep) side *= 2;
  return side;
}

/// Cubes that meet the box around the view.
std::vector<openvdb::Coord> coarseCubes(const VoxelCamera& camera, double reach, int side) {
  const double width = camera.k.width, height = camera.k.height;
  Eigen::AlignedBox3d box(camera.T_map_camera.translation());
  for (const double u : {-1.0, width}) {
    for (const double v : {-1.0, height}) {
      const Eigen::Vector3d ray((u - camera.k.cx) / camera.k.fx, (v - camera.k.cy) / camera.k.fy, 1.0);
      box.extend(camera.T_map_camera * (reach * ray));
    }
  }
  const auto cube = [&](const Eigen::Vector3d& p, int axis) {
    return static_cast<int>(std::floor(p[axis] / camera.voxel_size / side)) * side;
  };
  std::vector<openvdb::Coord> cubes;
  for (int x = cube(box.min(), 0); x <= cube(box.max(), 0); x += side) {
    for (int y = cube(box.min(), 1); y <= cube(box.max(), 1); y += side) {
      for (int z = cube(box.min(), 2); z <= cube(box.max(), 2); z += side) cubes.emplace_back(x, y, z);
    }
  }
  return cubes;
}

}  // namespace

VoxelCamera::VoxelCamera(const CameraIntrinsics& intrinsics, const Eigen::Isometry3d& T_map_camera_in,
                         double voxel_size_in)
    : k(intrinsics), T_map_camera(T_map_camera_in), voxel_size(voxel_size_in), near_depth(voxel_size_in) {
  const Eigen::Isometry3d T_camera_map = T_map_camera.inverse();
  axes = voxel_size * T_camera_map.linear();
  origin = T_camera_map.translation();
}

std::vector<BlockVisit> blocksInView(const VoxelCamera& camera, const DepthPyramid& pyramid, bool carve) {
  const double reach = pyramid.maxReach();
  if (!(reach > camera.near_depth)) return {};
  const int side = coarseSide(reach, camera.voxel_size);
  const std::vector<openvdb::Coord> cubes = coarseCubes(camera, reach, side);
  std::vector<std::vector<BlockVisit>> parts(cubes.size());
  const ViewDivider divider(camera, pyramid, carve);
  tbb::parallel_for(std::size_t{0}, cubes.size(),
                    [&](std::size_t i) { divider.divide(cubes[i], side, parts[i]); });
  std::vector<BlockVisit> visits;
  for (const auto& part : parts) visits.insert(visits.end(), part.begin(), part.end());
  return visits;
}

}  // namespace ttsdf
