#include "surface_survey.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "ttsdf_localization/fusion/tsdf_volume_grids.h"
#include "ttsdf_localization/signed_field/sampled_field_methods.h"

namespace ttsdf {
namespace {

constexpr int kTileSide = 128;
constexpr int kHalo = 10;  // what sharpening and smoothing look at
constexpr Eigen::Index kTriangleStride = 16;

/// What one tile says about the whole surface.
struct TileSurface {
  std::vector<Eigen::Vector3f> vertices;  // map frame [m]
  std::vector<Eigen::Vector3f> normals;   // of some triangles
  std::vector<float> areas;
};

class Survey {
 public:
  Survey(const TsdfVolume& volume, bool with_normals) : volume_(volume), with_normals_(with_normals) {}

  TileSurface look(const Eigen::Array3i& begin, const Dims& size) const {
    const ObservedGrid observed = observedGrid(volume_, begin - kHalo, size + 2 * kHalo, 1);
    TileSurface result;
    if (std::find(observed.state.begin(), observed.state.end(), Observation::kBand) == observed.state.end())
      return result;
    const ObservedSurface surface = observedSurface(observed, kMinSurfacePiece, 1, true);
    const auto h = static_cast<float>(volume_.options().voxel_size);
    const Eigen::Array3f low = h * begin.cast<float>(), high = h * (begin + size).cast<float>();
    const auto& vertices = surface.mesh.vertices;
    const auto inside = [&](Eigen::Index n) {
      return (vertices.col(n).array() >= low).all() && (vertices.col(n).array() < high).all();
    };
    for (Eigen::Index n = 0; n < vertices.cols(); ++n) {
      if (inside(n)) result.vertices.emplace_back(vertices.col(n));
    }
    for (Eigen::Index n = 0; with_normals_ && n < surface.mesh.triangles.cols(); n += kTriangleStride) {
      const Eigen::Vector3i t = surface.mesh.triangles.col(n);
      if (!inside(t[0])) continue;
      const Eigen::Vector3f a = vertices.col(t[0]);
      const Eigen::Vector3f area = (vertices.col(t[1]) - a).cross(vertices.col(t[2]) - a);
      const Eigen::Vector3f normal =
          surface.normals.col(t[0]) + surface.normals.col(t[1]) + surface.normals.col(t[2]);
      result.normals.push_back(normal.normalized());
      result.areas.push_back(area.norm());
    }
    return result;
  }

 private:
  const TsdfVolume& volume_;
  bool with_normals_;
};

Eigen::Matrix3Xf columns(const std::vector<TileSurface>& tiles,
                         std::vector<Eigen::Vector3f> TileSurface::*member) {
  std::size_t count = 0;
  for (const TileSurface& tile : tiles) count += (tile.*member).size();
  Eigen::Matrix3Xf all(3, static_cast<Eigen::Index>(count));
  Eigen::Index n = 0;
  for (const TileSurface& tile : tiles) {
    for (const Eigen::Vector3f& v : tile.*member) all.col(n++) = v;
  }
  return all;
}

}  // namespace

Tiling::Tiling(const Dims& dims, int side) : dims_(dims) {
  counts_ = (dims + side - 1) / side;
  sides_ = ((dims + counts_ - 1) / counts_ + 7) / 8 * 8;
  counts_ = (dims + sides_ - 1) / sides_;
}

Tiling::Box Tiling::box(int number) const {
  const Dims at(number % counts_[0], number / counts_[0] % counts_[1], number / counts_[0] / counts_[1]);
  const Dims begin = at * sides_;
  return {begin, sides_.min(dims_ - begin)};
}

void throwNoSurface() {
  throw std::runtime_error(
      "signed field: got no zero crossing between observed voxels (in pieces of at least " +
      std::to_string(kMinSurfacePiece) + "), wanted an observed surface");
}

GridGeometry surveyGrid(const TsdfVolume& volume, const BuildOptions& options, const ProgressStep& step) {
  if (volume.empty()) throwNoSurface();
  const openvdb::CoordBBox box = volume.grids().tsdf->evalActiveVoxelBoundingBox();
  const Eigen::Array3i begin(box.min().x(), box.min().y(), box.min().z());
  const Tiling tiling(Dims(box.dim().x(), box.dim().y(), box.dim().z()), kTileSide);
  const Survey survey(volume, options.align_axes);
  std::vector<TileSurface> tiles(static_cast<std::size_t>(tiling.count()));
  parallelFor(tiling.count(), options.threads, step, [&](int number) {
    const Tiling::Box tile = tiling.box(number);
    tiles[static_cast<std::size_t>(number)] = survey.look(begin + tile.begin, tile.size);
  });
  Eigen::Matrix3d R_map_grid = Eigen::Matrix3d::Identity();
  if (options.align_axes) {
    const Eigen::Matrix3Xf normals = columns(tiles, &TileSurface::normals);
    Eigen::VectorXf areas(normals.cols());
    Eigen::Index n = 0;
    for (const TileSurface& tile : tiles) {
      for (const float area : tile.areas) areas[n++] = area;
    }
    R_map_grid = gridRotation(normals, areas);
  }
  const Eigen::Matrix3Xf vertices = columns(tiles, &TileSurface::vertices);
  if (vertices.cols() == 0) throwNoSurface();
  return gridAround(vertices, R_map_grid, volume.options().voxel_size, options.margin);
}

}  // namespace ttsdf
