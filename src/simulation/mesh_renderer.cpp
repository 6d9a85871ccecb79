#include "ttsdf_localization/simulation/mesh_renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "row_noise.h"

namespace ttsdf {

namespace {

constexpr double kNearest = 1e-3;  // [m] from the image plane

struct DepthBuffer {
  int width, height;
  std::vector<double> depth;  // infinity: nothing
  std::vector<int> triangle;  // -1: nothing
};

struct Corner {
  double u, v, inverse_depth;
};

// Twice the signed area of (a, b, p); its sign says on which side of the edge the pixel lies.
double edge(const Corner& a, const Corner& b, double u, double v) {
  return (b.u - a.u) * (v - a.v) - (b.v - a.v) * (u - a.u);
}

// 1 / depth is linear over the picture of a plane, so it is what is interpolated.
void drawTriangle(const std::array<Corner, 3>& c, int index, DepthBuffer& buffer) {
  const double area = edge(c[0], c[1], c[2].u, c[2].v);
  if (area == 0.0) return;
  const auto [u_low, u_high] = std::minmax({c[0].u, c[1].u, c[2].u});
  const auto [v_low, v_high] = std::minmax({c[0].v, c[1].v, c[2].v});
  if (!(u_high >= 0.0 && v_high >= 0.0 && u_low < buffer.width && v_low < buffer.height)) return;
  const int u_begin = static_cast<int>(std::ceil(std::max(u_low, 0.0)));
  const int u_end = static_cast<int>(std::floor(std::min(u_high, buffer.width - 1.0)));
  const int v_begin = static_cast<int>(std::ceil(std::max(v_low, 0.0)));
  const int v_end = static_cast<int>(std::floor(std::min(v_high, buffer.height - 1.0)));
  for (int v = v_begin; v <= v_end; ++v) {
    for (int u = u_begin; u <= u_end; ++u) {
      const double w0 = edge(c[1], c[2], u, v) / area, w1 = edge(c[2], c[0], u, v) / area;
      const double w2 = 1.0 - w0 - w1;
      if (w0 < 0.0 || w1 < 0.0 || w2 < -1e-12) continue;
      const double depth =
          1.0 / (w0 * c[0].inverse_depth + w1 * c[1].inverse_depth + w2 * c[2].inverse_depth);
      const auto pixel =
          static_cast<std::size_t>(v) * static_cast<std::size_t>(buffer.width) + static_cast<std::size_t>(u);
      if (depth >= buffer.depth[pixel]) continue;
      buffer.depth[pixel] = depth;
      buffer.triangle[pixel] = index;
    }
  }
}

DepthBuffer draw(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& p_camera, const CameraIntrinsics& K) {
  const auto pixels = static_cast<std::size_t>(K.width) * static_cast<std::size_t>(K.height);
  DepthBuffer buffer{K.width, K.height, std::vector<double>(pixels, std::numeric_limits<double>::infinity()),
                     std::vector<int>(pixels, -1)};
  for (Eigen::Index n = 0; n < mesh.triangles.cols(); ++n) {
    std::array<Corner, 3> corners{};
    bool in_front = true;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d p = p_camera.col(mesh.triangles(k, n));
      in_front = in_front && p.z() > kNearest;
      corners[static_cast<std::size_t>(k)] = {K.fx * p.x() / p.z() + K.cx, K.fy * p.y() / p.z() + K.cy,
                                              1.0 / p.z()};
    }
    if (in_front) drawTriangle(corners, static_cast<int>(n), buffer);
  }
  return buffer;
}

double incidenceCosine(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& p_camera, int triangle,
                       const Eigen::Vector3d& ray) {
  const Eigen::Vector3d a = p_camera.col(mesh.triangles(0, triangle));
  const Eigen::Vector3d b = p_camera.col(mesh.triangles(1, triangle));
  const Eigen::Vector3d c = p_camera.col(mesh.triangles(2, triangle));
  return std::abs((b - a).cross(c - a).normalized().dot(ray.normalized()));
}

}  // namespace

DepthImage renderMesh(const SurfaceMesh& mesh, const DepthCameraOptions& options,
                      const Eigen::Isometry3d& T_map_camera, std::uint64_t frame) {
  const CameraIntrinsics K = DepthCamera(options).intrinsics();
  if (!T_map_camera.matrix().allFinite()) {
    throw std::invalid_argument("render: got a camera pose that is not finite, wanted a rigid motion");
  }
  if (!mesh.empty() && (mesh.triangles.minCoeff() < 0 || mesh.triangles.maxCoeff() >= mesh.vertices.cols())) {
    throw std::invalid_argument("render: got a triangle whose vertex does not exist");
  }
  const Eigen::Matrix3Xd p_camera =
      (T_map_camera.inverse() * mesh.vertices.cast<double>().colwise().homogeneous()).topRows<3>();
  const DepthBuffer buffer = draw(mesh, p_camera, K);

  DepthImage image{K.width, K.height, std::vector<float>(buffer.depth.size(), 0.0f)};
  const auto width = static_cast<std::size_t>(K.width);
  for (int v = 0; v < K.height; ++v) {
    RowNoise noise(options.noise, options.fx, frame, v);
    const std::size_t row = static_cast<std::size_t>(v) * width;
    const double* depth = &buffer.depth[row];
    for (std::size_t u = 0; u < width; ++u) {
      const int triangle = buffer.triangle[row + u];
      if (triangle < 0) continue;
      const auto cosine = [&] {
        const Eigen::Vector3d ray((static_cast<double>(u) - K.cx) / K.fx, (v - K.cy) / K.fy, 1.0);
        return incidenceCosine(mesh, p_camera, triangle, ray);
      };
      if (!noise.returns(atDepthEdge(depth, width, u), cosine)) continue;
      const double reading = noise.measure(depth[u]);
      if (reading >= options.min_range && reading <= options.max_range) {
        image.depth[row + u] = static_cast<float>(reading);
      }
    }
  }
  return image;
}

}  // namespace ttsdf
