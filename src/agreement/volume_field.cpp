#include "volume_field.h"

#include <array>
#include <cmath>
#include <stdexcept>

#include "ttsdf_localization/fusion/tsdf_volume_grids.h"

namespace ttsdf {

namespace {

/// Corner samples of a cell, x fastest; false if one of them lies outside the band.
bool corners(const openvdb::FloatGrid::ConstAccessor& tsdf, const openvdb::Coord& cell,
             std::array<float, 8>& values) {
  for (int n = 0; n < 8; ++n) {
    if (!tsdf.probeValue(cell.offsetBy(n & 1, n >> 1 & 1, n >> 2), values[static_cast<std::size_t>(n)]))
      return false;
  }
  return true;
}

/// Value and gradient per voxel.
struct Interpolated {
  float value, dx, dy, dz;
};

Interpolated interpolate(const std::array<float, 8>& v, float fx, float fy, float fz) {
  const auto mix = [](float a, float b, float share) { return a + share * (b - a); };
  const float v00 = mix(v[0], v[1], fx), v10 = mix(v[2], v[3], fx), v01 = mix(v[4], v[5], fx),
              v11 = mix(v[6], v[7], fx);
  const float low = mix(v00, v10, fy), high = mix(v01, v11, fy);
  Interpolated result{};
  result.value = mix(low, high, fz);
  result.dx = mix(mix(v[1] - v[0], v[3] - v[2], fy), mix(v[5] - v[4], v[7] - v[6], fy), fz);
  result.dy = mix(v10 - v00, v11 - v01, fz);
  result.dz = high - low;
  return result;
}

}  // namespace

VolumeField::VolumeField(const TsdfVolume& volume) : volume_(volume) {
  if (volume.empty()) throw std::invalid_argument("volume field: got a volume without surface");
  const openvdb::CoordBBox box = volume.grids().tsdf->evalActiveVoxelBoundingBox();
  geometry_.voxel_size = volume.options().voxel_size;
  geometry_.origin = volume.origin();
  for (int axis = 0; axis < 3; ++axis) {
    geometry_.dims[axis] = box.dim()[axis];
    geometry_.T_map_grid.translation()[axis] = geometry_.voxel_size * box.min()[axis];
  }
}

void VolumeField::evaluate(const PointSpan& points, const SampleSpan& samples) const {
  const auto tsdf = volume_.grids().tsdf->getConstAccessor();
  const auto per_voxel = static_cast<float>(1.0 / geometry_.voxel_size);
  for (int n = 0; n < points.size; ++n) {
    samples.value[n] = samples.gradient_x[n] = samples.gradient_y[n] = samples.gradient_z[n] = 0.0F;
    const Eigen::Vector3d p(points.x[n], points.y[n], points.z[n]);
    samples.state[n] = PointState::kOutside;
    if (!p.allFinite() || !geometry_.containsIndex(geometry_.toIndex(p))) continue;
    const Eigen::Vector3d index = p / geometry_.voxel_size, floor = index.array().floor();
    const openvdb::Coord cell(static_cast<int>(floor.x()), static_cast<int>(floor.y()),
                              static_cast<int>(floor.z()));
    std::array<float, 8> values{};
    samples.state[n] = PointState::kUnknown;
    if (!corners(tsdf, cell, values)) continue;
    const Eigen::Vector3f f = (index - floor).cast<float>();
    const Interpolated at = interpolate(values, f.x(), f.y(), f.z());
    samples.state[n] = PointState::kValid;
    samples.value[n] = at.value;
    samples.gradient_x[n] = per_voxel * at.dx;
    samples.gradient_y[n] = per_voxel * at.dy;
    samples.gradient_z[n] = per_voxel * at.dz;
  }
}

}  // namespace ttsdf
