#include "ros/operator/map_visualization.h"

#include <sensor_msgs/point_cloud2_iterator.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace ttsdf {

namespace {

geometry_msgs::Point toPoint(const Eigen::Vector3f& p) {
  geometry_msgs::Point point;
  point.x = static_cast<double>(p.x());
  point.y = static_cast<double>(p.y());
  point.z = static_cast<double>(p.z());
  return point;
}

/// Each axis of the normal tints one colour channel, so that neighbouring walls differ.
std_msgs::ColorRGBA facingColor(const Eigen::Vector3f& normal) {
  const Eigen::Vector3f tint = Eigen::Vector3f::Constant(0.35F) + 0.3F * (normal + Eigen::Vector3f::Ones());
  std_msgs::ColorRGBA color;
  color.r = tint.x();
  color.g = tint.y();
  color.b = tint.z();
  color.a = 1.0F;
  return color;
}

struct Rgb {
  std::uint8_t r, g, b;
};

Rgb distanceColor(float value, float range) {
  const float share = std::min(1.0F, std::abs(value) / range);
  const auto strong = static_cast<std::uint8_t>(255.0F);
  const auto pale = static_cast<std::uint8_t>(255.0F * (1.0F - share));
  return value >= 0.0F ? Rgb{strong, pale, pale} : Rgb{pale, pale, strong};
}

/// Points of the plane over the map-frame bounding box of the grid.
Eigen::Matrix3Xf planePoints(const GridGeometry& geometry, double height, double spacing) {
  Eigen::AlignedBox3d box;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Array3i bits(corner & 1, (corner >> 1) & 1, (corner >> 2) & 1);
    box.extend(geometry.samplePosition((bits * (geometry.dims - 1)).matrix().cast<double>()));
  }
  const int columns = static_cast<int>(box.sizes().x() / spacing) + 1;
  const int rows = static_cast<int>(box.sizes().y() / spacing) + 1;
  Eigen::Matrix3Xf points(3, static_cast<Eigen::Index>(columns) * rows);
  for (int row = 0, n = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column, ++n) {
      points.col(n) = Eigen::Vector3d(box.min().x() + column * spacing, box.min().y() + row * spacing, height)
                          .cast<float>();
    }
  }
  return points;
}

}  // namespace

SurfaceMesh clusterVertices(const SurfaceMesh& mesh, double cell) {
  std::map<std::array<int, 3>, int> cluster_of_cube;
  std::vector<int> cluster(static_cast<std::size_t>(mesh.vertices.cols()));
  std::vector<Eigen::Vector3d> sums;
  std::vector<int> sizes;
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Array3i cube = (mesh.vertices.col(v).cast<double>().array() / cell).floor().cast<int>();
    const auto found =
        cluster_of_cube.try_emplace({cube[0], cube[1], cube[2]}, static_cast<int>(sums.size())).first;
    if (found->second == static_cast<int>(sums.size())) {
      sums.push_back(Eigen::Vector3d::Zero());
      sizes.push_back(0);
    }
    cluster[static_cast<std::size_t>(v)] = found->second;
    sums[static_cast<std::size_t>(found->second)] += mesh.vertices.col(v).cast<double>();
    ++sizes[static_cast<std::size_t>(found->second)];
  }
  SurfaceMesh joined;
  joined.origin = mesh.origin;
  joined.vertices.resize(3, static_cast<Eigen::Index>(sums.size()));
  for (std::size_t c = 0; c < sums.size(); ++c) {
    joined.vertices.col(static_cast<Eigen::Index>(c)) = (sums[c] / sizes[c]).cast<float>();
  }
  joined.triangles.resize(3, mesh.triangles.cols());
  Eigen::Index kept = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    Eigen::Vector3i corners;
    for (int c = 0; c < 3; ++c) corners[c] = cluster[static_cast<std::size_t>(mesh.triangles(c, t))];
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    joined.triangles.col(kept++) = corners;
  }
  joined.triangles.conservativeResize(3, kept);
  return joined;
}

void requireShowable(const TtSdfMap& map) {
  constexpr std::size_t kMost = 100'000'000;  // 400 MB when decompressed
  if (map.geometry.voxelCount() <= kMost) return;
  throw std::runtime_error("the map has " + std::to_string(map.geometry.voxelCount()) +
                           " voxels, which is too much to decompress for display");
}

visualization_msgs::Marker surfaceMarker(const SurfaceMesh& mesh, int max_triangles,
                                         const std::string& frame_id, const ros::Time& stamp) {
  if (mesh.triangles.cols() > max_triangles) {
    const Eigen::Vector3f size = mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff();
    // A quarter of the triangles per doubling of the cell; the start is finer than any map.
    SurfaceMesh thinned = mesh;
    for (double cell = 1e-3 * static_cast<double>(size.maxCoeff()); thinned.triangles.cols() > max_triangles;
         cell *= 1.4) {
      thinned = clusterVertices(mesh, cell);
    }
    return surfaceMarker(thinned, max_triangles, frame_id, stamp);
  }
  visualization_msgs::Marker marker;
  marker.header.frame_id = frame_id;
  marker.header.stamp = stamp;
  marker.ns = "surface";
  marker.type = visualization_msgs::Marker::TRIANGLE_LIST;
  marker.pose.orientation.w = 1.0;
  marker.pose.position.x = mesh.origin.x();  // the points are floats: places of a survey are kept here
  marker.pose.position.y = mesh.origin.y();
  marker.pose.position.z = mesh.origin.z();
  marker.scale.x = marker.scale.y = marker.scale.z = 1.0;
  marker.color.a = 1.0F;
  marker.action = mesh.empty() ? visualization_msgs::Marker::DELETE : visualization_msgs::Marker::ADD;
  const auto corners = static_cast<std::size_t>(3 * mesh.triangles.cols());
  marker.points.reserve(corners);
  marker.colors.reserve(corners);
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const Eigen::Vector3f a = mesh.vertices.col(mesh.triangles(0, t));
    const Eigen::Vector3f b = mesh.vertices.col(mesh.triangles(1, t));
    const Eigen::Vector3f c = mesh.vertices.col(mesh.triangles(2, t));
    const std_msgs::ColorRGBA color = facingColor((b - a).cross(c - a).normalized());
    for (const auto& corner : {a, b, c}) {
      marker.points.push_back(toPoint(corner));
      marker.colors.push_back(color);
    }
  }
  return marker;
}

sensor_msgs::PointCloud2 sliceCloud(const DistanceField& field, double height, double spacing, double range,
                                    const std::string& frame_id, const ros::Time& stamp) {
  const Eigen::Matrix3Xf points =
      planePoints(field.geometry(), height - field.geometry().origin.z(), spacing);
  const FieldSamples samples = field.evaluate(points);
  const auto inside = static_cast<std::size_t>(std::count_if(
      samples.states.begin(), samples.states.end(), [](PointState s) { return s != PointState::kOutside; }));

  sensor_msgs::PointCloud2 cloud;
  cloud.header.frame_id = frame_id;
  cloud.header.stamp = stamp;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(2, "xyz", "rgb");
  modifier.resize(inside);
  sensor_msgs::PointCloud2Iterator<float> xyz(cloud, "x");
  sensor_msgs::PointCloud2Iterator<std::uint8_t> bgr(cloud, "rgb");
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    const PointState state = samples.states[static_cast<std::size_t>(n)];
    if (state == PointState::kOutside) continue;
    const Rgb color = state == PointState::kValid
                          ? distanceColor(samples.values[n], static_cast<float>(range))
                          : Rgb{70, 70, 70};
    for (int axis = 0; axis < 3; ++axis)
      xyz[axis] = points(axis, n) + static_cast<float>(field.geometry().origin[axis]);
    bgr[0] = color.b;
    bgr[1] = color.g;
    bgr[2] = color.r;
    ++xyz;
    ++bgr;
  }
  return cloud;
}

}  // namespace ttsdf
