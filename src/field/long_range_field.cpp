#include "ttsdf_localization/field/long_range_field.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "compressed/quantized_bricks.h"
#include "nearest_feet.h"

namespace ttsdf {

namespace {

// Voxels between the samples whose foot points are taken: surfaces are continuous, and no cell needs many. A
// map's distances may end three voxels behind a surface.
int footStep(int spacing) { return std::clamp(spacing / 2, 2, 3); }

/// The map's box, sampled every so many voxels. The last sample of an axis may lie beyond the box.
GridGeometry coarseGrid(const GridGeometry& map, const LongRangeOptions& options) {
  GridGeometry geometry = map;
  for (int spacing = std::max(1, options.spacing_voxels);; ++spacing) {
    geometry.dims = (map.dims - 1 + spacing - 1) / spacing + 1;
    geometry.voxel_size = spacing * map.voxel_size;
    if (geometry.voxelCount() <= std::max<std::size_t>(options.max_samples, 8)) return geometry;
  }
}

/// Place of a sample of the coarse grid.
std::size_t linear(const Dims& dims, const Dims& at) {
  return static_cast<std::size_t>(at[0]) +
         static_cast<std::size_t>(dims[0]) *
             (static_cast<std::size_t>(at[1]) +
              static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(at[2]));
}

std::array<int, 3> sizesOf(const GridGeometry& geometry) {
  return {{geometry.dims[0], geometry.dims[1], geometry.dims[2]}};
}

/// Visits all lines of the coarse grid along the axis in which a walk through the field costs least.
template <class Visit>
void forEachLine(const Dims& dims, const std::array<int, 3>& order, const KeepGoing& keep_going,
                 const Visit& visit) {
  Dims cell = Dims::Zero();
  for (cell[order[0]] = 0; cell[order[0]] < dims[order[0]]; ++cell[order[0]]) {
    goOn(keep_going);
    for (cell[order[1]] = 0; cell[order[1]] < dims[order[1]]; ++cell[order[1]]) {
      cell[order[2]] = 0;
      visit(cell);
    }
  }
}

/// Surface points, line of cells by line of cells.
class FootFinder {
 public:
  FootFinder(const DistanceField& field, const GridGeometry& coarse)
      : field_(field),
        map_(field.geometry()),
        coarse_(coarse.dims),
        spacing_(static_cast<int>(std::lround(coarse.voxel_size / map_.voxel_size))),
        step_(footStep(spacing_)),
        axis_(field.walkOrder()[2]),
        values_(coarse.voxelCount()) {}

  /// Asks the field for the samples of a line of the coarse grid; all of them before the first `feet`.
  void sample(Dims cell) {
    const int length = coarse_[axis_];
    points_.resize(3, length);
    for (int n = 0; n < length; ++n) {
      cell[axis_] = n;
      points_.col(n) = position((cell * spacing_).min(map_.dims - 1));
    }
    const FieldSamples samples = field_.evaluate(points_);
    for (int n = 0; n < length; ++n) {
      cell[axis_] = n;
      values_[linear(coarse_, cell)] = samples.values[n];
    }
  }

  float value(const Dims& cell) const { return values_[linear(coarse_, cell)]; }

  /// The foot points x - f grad f of the map's samples in those cells of a line that may have a surface.
  void feet(Dims cell, NearestFeet& feet) {
    near_.clear();
    for (int n = 0; n < coarse_[axis_]; ++n) {
      cell[axis_] = n;
      if (!mayHaveSurface(cell)) continue;
      for (int p = 0; p < spacing_; p += step_) {
        for (int q = 0; q < spacing_; q += step_) {
          for (int r = 0; r < spacing_; r += step_) {
            const Dims sample = cell * spacing_ + Dims(p, q, r);
            if ((sample < map_.dims).all()) near_.push_back(position(sample));
          }
        }
      }
    }
    addFeet(feet);
  }

 private:
  /// A surface in a cell is no further from one of its corners than half its diagonal; maps overshoot a
  /// little. Maps end their distances a few voxels behind surfaces: that alone says nothing, a change of sign
  /// does.
  bool mayHaveSurface(const Dims& cell) const {
    constexpr float kBehind = 2.0f;  // voxels
    const auto voxel = static_cast<float>(map_.voxel_size);
    const float reach = 1.1f * 0.5f * std::sqrt(3.0f) * static_cast<float>(spacing_) * voxel;
    bool positive = false, negative = false;
    for (int corner = 0; corner < 8; ++corner) {
      const Dims at = (cell + Dims(corner & 1, corner >> 1 & 1, corner >> 2)).min(coarse_ - 1);
      const float f = value(at);
      if (f <= reach && f >= -kBehind * voxel) return true;
      positive = positive || f >= 0.0f;
      negative = negative || f < 0.0f;
    }
    return positive && negative;
  }

  Eigen::Vector3f position(const Dims& index) const {
    return map_.samplePosition(index.cast<double>().matrix()).cast<float>();
  }

  /// Foot points of the samples near the line, kept where the field agrees that they lie on the surface.
  void addFeet(NearestFeet& feet) {
    if (near_.empty()) return;
    const FieldSamples samples = field_.evaluate(asMatrix(near_));
    const auto reach = static_cast<float>(1.8 * step_ * map_.voxel_size);
    found_.clear();
    for (std::size_t n = 0; n < near_.size(); ++n) {
      const auto column = static_cast<Eigen::Index>(n);
      const Eigen::Vector3f gradient = samples.gradients.col(column);
      const float squared = gradient.squaredNorm();
      if (samples.states[n] != PointState::kValid) continue;
      if (std::abs(samples.values[column]) > reach || squared < 0.25f) continue;
      found_.push_back(near_[n] - samples.values[column] * gradient / squared);
    }
    if (found_.empty()) return;
    const FieldSamples check = field_.evaluate(asMatrix(found_));
    for (std::size_t n = 0; n < found_.size(); ++n) {
      if (check.states[n] != PointState::kValid) continue;
      if (std::abs(check.values[static_cast<Eigen::Index>(n)]) >= map_.voxel_size) continue;
      feet.add((map_.toIndex(found_[n].cast<double>()) / spacing_).cast<float>());
    }
  }

  static Eigen::Matrix3Xf asMatrix(const std::vector<Eigen::Vector3f>& points) {
    return Eigen::Map<const Eigen::Matrix3Xf>(points.front().data(), 3,
                                              static_cast<Eigen::Index>(points.size()));
  }

  const DistanceField& field_;
  const GridGeometry& map_;
  Dims coarse_;
  int spacing_, step_;
  int axis_;  // along the lines
  std::vector<float> values_;
  Eigen::Matrix3Xf points_;
  std::vector<Eigen::Vector3f> near_, found_;
};

}  // namespace

class LongRangeField::Impl {
 public:
  explicit Impl(const GridGeometry& geometry)
      : grid(geometry, {}, Interpolation::kTrilinear, ModeOrder{{0, 1, 2}}),
        bricks(sizesOf(geometry)),
        T_grid_map(geometry.T_map_grid.inverse().cast<float>()) {}

  void fill(const NearestFeet& feet, const FootFinder& signs) {
    const GridGeometry& g = grid.geometry();
    const auto spacing = static_cast<float>(g.voxel_size);
    for (std::size_t id = 0; id < bricks.idCount(); ++id) bricks.reserve(id);
    bricks.allocate();
    float samples[kBrickSamples];
    for (int c = 0; c < bricks.counts()[2]; ++c) {
      for (int b = 0; b < bricks.counts()[1]; ++b) {
        for (int a = 0; a < bricks.counts()[0]; ++a) {
          for (int n = 0; n < kBrickSamples; ++n) {
            const Dims place(n % kBrickSide, n / kBrickSide % kBrickSide, n / kBrickSide / kBrickSide);
            const Dims at = (Dims(a, b, c) * kBrickCells + place).min(g.dims - 1);
            const float distance = spacing * feet.distance(at[0], at[1], at[2]);
            samples[n] = signs.value(at) < 0.0f ? -distance : distance;
          }
          bricks.set(bricks.idOf(a, b, c), samples);
        }
      }
    }
  }

  GridLocator grid;
  QuantizedBricks bricks;
  Eigen::Isometry3f T_grid_map;
};

LongRangeField::LongRangeField(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LongRangeField::~LongRangeField() = default;
const GridGeometry& LongRangeField::geometry() const { return impl_->grid.geometry(); }
std::size_t LongRangeField::memoryBytes() const { return impl_->bricks.memoryBytes(); }

std::size_t LongRangeField::bytesFor(const GridGeometry& map, const LongRangeOptions& options) {
  const auto sizes = sizesOf(coarseGrid(map, options));
  std::size_t count = 1;
  for (const int n : QuantizedBricks::countsFor(sizes)) count *= static_cast<std::size_t>(n);
  return QuantizedBricks::bytesFor(sizes, count);
}

std::shared_ptr<const LongRangeField> LongRangeField::make(const DistanceField& field,
                                                           const LongRangeOptions& options,
                                                           const KeepGoing& keep_going) {
  const GridGeometry coarse = coarseGrid(field.geometry(), options);
  auto impl = std::make_unique<Impl>(coarse);
  NearestFeet feet(coarse.dims);
  FootFinder finder(field, coarse);
  const std::array<int, 3> order = field.walkOrder();
  forEachLine(coarse.dims, order, keep_going, [&](const Dims& cell) { finder.sample(cell); });
  forEachLine(coarse.dims, order, keep_going, [&](const Dims& cell) { finder.feet(cell, feet); });
  if (feet.empty()) return nullptr;
  feet.spread(keep_going);
  impl->fill(feet, finder);
  return std::shared_ptr<const LongRangeField>(new LongRangeField(std::move(impl)));
}

namespace {

/// Points of a chunk outside of the grid, moved to the nearest place of its box.
struct Moved {
  int count = 0;
  std::int32_t point[kChunk];  // in the chunk
  float x[kChunk], y[kChunk], z[kChunk];
  Eigen::Vector3f by[kChunk];  // from there to the point, map frame [m]
};

}  // namespace

void LongRangeField::evaluate(const PointSpan& points, const SampleSpan& samples) const {
  const GridLocator& grid = impl_->grid;
  const GridGeometry& g = grid.geometry();
  const Eigen::Vector3f last = ((g.dims - 1).cast<float>() * static_cast<float>(g.voxel_size)).matrix();
  const float farthest = last.norm();
  const Eigen::Isometry3f T_map_grid = g.T_map_grid.cast<float>();
  CellChunk cells, inside;
  CornerChunk corners;
  Moved moved;
  std::int32_t missing[kChunk];
  for (int begin = 0; begin < points.size; begin += kChunk) {
    cells.size = std::min(kChunk, points.size - begin);
    grid.locate(points, begin, cells);
    moved.count = 0;
    for (int n = 0; n < cells.size; ++n) {
      if (cells.state[n] != PointState::kOutside) continue;
      const Eigen::Vector3f p(points.x[begin + n], points.y[begin + n], points.z[begin + n]);
      const Eigen::Vector3f in_grid = impl_->T_grid_map * p;
      if (!in_grid.allFinite()) continue;
      const Eigen::Vector3f nearest = in_grid.cwiseMax(Eigen::Vector3f::Zero()).cwiseMin(last);
      if (!((in_grid - nearest).norm() <= farthest)) continue;
      const Eigen::Vector3f place = T_map_grid * nearest;
      const int m = moved.count++;
      moved.point[m] = n;
      moved.x[m] = place.x(), moved.y[m] = place.y(), moved.z[m] = place.z();
      moved.by[m] = T_map_grid.linear() * (in_grid - nearest);
    }
    if (moved.count > 0) {
      inside.size = moved.count;
      grid.locate(PointSpan{moved.x, moved.y, moved.z, moved.count}, 0, inside);
      for (int m = 0; m < moved.count; ++m) {
        const std::int32_t n = moved.point[m];
        for (int axis = 0; axis < 3; ++axis) {
          cells.cell[axis][n] = inside.cell[axis][m];
          cells.fraction[axis][n] = inside.fraction[axis][m];
        }
        cells.state[n] = inside.state[m];
      }
    }
    impl_->bricks.corners(cells, corners, missing);
    grid.interpolate(cells, corners, samples, begin);
    for (int m = 0; m < moved.count; ++m) {
      const int n = begin + moved.point[m];
      if (samples.state[n] == PointState::kOutside) continue;
      Eigen::Vector3f out(samples.gradient_x[n], samples.gradient_y[n], samples.gradient_z[n]);
      const float value = samples.value[n], slope = out.norm();
      if (slope > 1e-6f) out *= value / slope;
      // From the surface point to where we are: first to the box's border, then on to the point.
      const Eigen::Vector3f from_surface = moved.by[m] + out;
      const float distance = std::max(from_surface.norm(), 1e-9f), sign = value < 0.0f ? -1.0f : 1.0f;
      samples.value[n] = sign * distance;
      samples.gradient_x[n] = sign * from_surface.x() / distance;
      samples.gradient_y[n] = sign * from_surface.y() / distance;
      samples.gradient_z[n] = sign * from_surface.z() / distance;
    }
  }
}

std::shared_ptr<const DistanceField> makeLongRangeField(const DistanceField& field,
                                                        const LongRangeOptions& options,
                                                        const KeepGoing& keep_going) {
  return LongRangeField::make(field, options, keep_going);
}

}  // namespace ttsdf
