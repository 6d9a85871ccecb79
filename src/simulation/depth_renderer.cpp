#include "depth_renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "ray_kernels.h"

// The loops over pixels in two versions, the right one chosen when the library is loaded: before the thread
// sanitizer is ready.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define TTSDF_PIXEL_LOOP __attribute__((target_clones("avx2", "default")))
#else
#define TTSDF_PIXEL_LOOP
#endif

namespace ttsdf {

namespace {

constexpr double kNearPlane = 1e-3;  ///< [m]

/// Corners of the bounding box in front of the near plane, and where its edges cross that plane: their
/// outline in the picture holds the outline of the solid.
std::vector<Eigen::Vector3d> clippedCorners(const Solid& solid, const Eigen::Isometry3d& T_camera_map) {
  std::array<Eigen::Vector3d, 8> corners;
  for (unsigned i = 0; i < 8; ++i) {
    const Eigen::Vector3d side(i & 1u ? 1.0 : -1.0, i & 2u ? 1.0 : -1.0, i & 4u ? 1.0 : -1.0);
    corners[i] = T_camera_map * (solid.pose() * side.cwiseProduct(solid.halfExtent()));
  }
  std::vector<Eigen::Vector3d> points;
  points.reserve(20);
  for (unsigned i = 0; i < 8; ++i) {
    const Eigen::Vector3d& a = corners[i];
    if (a.z() >= kNearPlane) points.push_back(a);
    for (unsigned bit = 1; bit < 8; bit <<= 1) {
      const Eigen::Vector3d& b = corners[i | bit];
      if ((i & bit) || (a.z() >= kNearPlane) == (b.z() >= kNearPlane)) continue;
      points.push_back(a + (b - a) * ((kNearPlane - a.z()) / (b.z() - a.z())));
    }
  }
  return points;
}

int clampedPixel(double pixel, int end) {
  return static_cast<int>(std::clamp(pixel, 0.0, static_cast<double>(end)));
}

/// What the loop over a row's pixels needs: directions base + x_u step with x_u = (u - cx) / fx.
struct RowTask {
  ray_kernels::Vec<double> origin, half, base, step;
  double cx, inverse_fx, index;
  int begin, end;
};

/// Neighbouring pixels that go through one vector instruction (or two, on machines without AVX).
constexpr int kLanes = 4;
using Pixels = double __attribute__((vector_size(kLanes * sizeof(double))));
using PixelsInRow = double __attribute__((vector_size(kLanes * sizeof(double)), aligned(8), may_alias));

template <class Primitive>
TTSDF_ALWAYS_INLINE void scanRow(const RowTask& task, double* depth, double* index) {
  for (int u = task.begin; u < task.end; u += kLanes) {
    Pixels x;
    for (int lane = 0; lane < kLanes; ++lane) x[lane] = (u + lane - task.cx) * task.inverse_fx;
    const ray_kernels::Vec<Pixels> d{task.base.x + x * task.step.x, task.base.y + x * task.step.y,
                                     task.base.z + x * task.step.z};
    const Pixels t = Primitive::firstHit(task.origin, d, task.half);
    auto& row_depth = *reinterpret_cast<PixelsInRow*>(depth + u);
    auto& row_index = *reinterpret_cast<PixelsInRow*>(index + u);
    const Pixels nearest = row_depth, before = row_index;
    row_index = t < nearest ? ray_kernels::broadcast<Pixels>(task.index) : before;
    row_depth = t < nearest ? t : nearest;
  }
}

TTSDF_PIXEL_LOOP void scanBox(const RowTask& task, double* depth, double* index) {
  scanRow<ray_kernels::Box>(task, depth, index);
}
TTSDF_PIXEL_LOOP void scanCylinder(const RowTask& task, double* depth, double* index) {
  scanRow<ray_kernels::Cylinder>(task, depth, index);
}
TTSDF_PIXEL_LOOP void scanSphere(const RowTask& task, double* depth, double* index) {
  scanRow<ray_kernels::Sphere>(task, depth, index);
}

ray_kernels::Vec<double> asVec(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

std::vector<VisibleSolid> visibleSolids(const std::vector<const Solid*>& solids,
                                        const CameraIntrinsics& intrinsics,
                                        const Eigen::Isometry3d& T_map_camera, double max_range) {
  const Eigen::Isometry3d T_camera_map = T_map_camera.inverse();
  std::vector<VisibleSolid> visible;
  for (const Solid* solid : solids) {
    const double depth = (T_camera_map * solid->center()).z();
    if (depth + solid->boundingRadius() < kNearPlane || depth - solid->boundingRadius() > max_range) continue;
    const std::vector<Eigen::Vector3d> points = clippedCorners(*solid, T_camera_map);
    if (points.empty()) continue;
    Eigen::AlignedBox2d outline;
    double nearest = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& p : points) {
      outline.extend(Eigen::Vector2d(intrinsics.fx * p.x() / p.z() + intrinsics.cx,
                                     intrinsics.fy * p.y() / p.z() + intrinsics.cy));
      nearest = std::min(nearest, p.z());
    }
    if (nearest > max_range) continue;
    VisibleSolid v;
    v.solid = solid;
    // One pixel of slack on either side against rounding.
    v.u_begin = clampedPixel(std::floor(outline.min().x()) - 1.0, intrinsics.width);
    v.u_end = clampedPixel(std::ceil(outline.max().x()) + 2.0, intrinsics.width);
    v.v_begin = clampedPixel(std::floor(outline.min().y()) - 1.0, intrinsics.height);
    v.v_end = clampedPixel(std::ceil(outline.max().y()) + 2.0, intrinsics.height);
    if (v.u_begin >= v.u_end || v.v_begin >= v.v_end) continue;
    v.R_solid_camera = solid->inversePose().linear() * T_map_camera.linear();
    v.origin = solid->inversePose() * T_map_camera.translation();
    v.nearest = nearest;
    visible.push_back(v);
  }
  std::stable_sort(visible.begin(), visible.end(),
                   [](const VisibleSolid& a, const VisibleSolid& b) { return a.nearest < b.nearest; });
  return visible;
}

void renderRow(const std::vector<VisibleSolid>& visible, const CameraIntrinsics& intrinsics, int v,
               RowBuffer& row) {
  // The last group of pixels may reach past the row's end.
  const std::size_t columns = static_cast<std::size_t>(intrinsics.width + kLanes);
  row.depth.assign(columns, std::numeric_limits<double>::infinity());
  row.index.assign(columns, -1.0);
  const double y = (v - intrinsics.cy) / intrinsics.fy;
  for (std::size_t i = 0; i < visible.size(); ++i) {
    const VisibleSolid& s = visible[i];
    if (v < s.v_begin || v >= s.v_end) continue;
    const RowTask task{asVec(s.origin),
                       asVec(s.solid->halfExtent()),
                       asVec(s.R_solid_camera.col(2) + y * s.R_solid_camera.col(1)),
                       asVec(s.R_solid_camera.col(0)),
                       intrinsics.cx,
                       1.0 / intrinsics.fx,
                       static_cast<double>(i),
                       s.u_begin,
                       s.u_end};
    switch (s.solid->shape()) {
      case SolidShape::kBox:
        scanBox(task, row.depth.data(), row.index.data());
        break;
      case SolidShape::kCylinder:
        scanCylinder(task, row.depth.data(), row.index.data());
        break;
      case SolidShape::kSphere:
        scanSphere(task, row.depth.data(), row.index.data());
        break;
    }
  }
  row.depth.resize(static_cast<std::size_t>(intrinsics.width));
  row.index.resize(static_cast<std::size_t>(intrinsics.width));
}

double incidenceCosine(const VisibleSolid& visible, const CameraIntrinsics& intrinsics, int u, int v,
                       double depth) {
  const Eigen::Vector3d direction((u - intrinsics.cx) / intrinsics.fx, (v - intrinsics.cy) / intrinsics.fy,
                                  1.0);
  const Eigen::Vector3d in_solid = visible.R_solid_camera * direction;
  const Eigen::Vector3d p_map = visible.solid->pose() * (visible.origin + depth * in_solid);
  const Eigen::Vector3d direction_map = visible.solid->pose().linear() * in_solid;
  return std::abs(visible.solid->normal(p_map).dot(direction_map)) / direction.norm();
}

}  // namespace ttsdf
