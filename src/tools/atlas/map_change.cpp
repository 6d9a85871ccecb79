#include "map_change.h"

#include <algorithm>
#include <cmath>

#include "ttsdf_localization/surface/surface_mesh.h"

namespace ttsdf {

namespace {

constexpr double kMoved = 0.75, kElsewhere = 2.0;  // voxels

/// How far the surface points of one edition are from the surface of the other.
struct Distances {
  double points = 0.0, moved = 0.0, in_free = 0.0, unknown = 0.0;
};

Distances distancesOf(const TtSdfMap& shown, const TtSdfMap& other) {
  const SurfaceMesh mesh = extractSurface(shown);
  const auto field = makeField(other);
  const double voxel = other.geometry.voxel_size;
  const Eigen::Vector3d shift = mesh.origin - field->geometry().origin;
  const Eigen::Matrix3Xf points = (mesh.vertices.cast<double>().colwise() + shift).cast<float>();
  const FieldSamples samples = field->evaluate(points);
  Distances sum;
  sum.points = static_cast<double>(points.cols());
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    const double off = std::abs(static_cast<double>(samples.values[n])) / voxel;
    if (samples.states[static_cast<std::size_t>(n)] != PointState::kValid) {
      sum.unknown += 1.0;
    } else if (off > kElsewhere) {
      sum.in_free += samples.values[n] > 0.0F ? 1.0 : 0.0;
    } else if (off > kMoved) {
      sum.moved += 1.0;
    }
  }
  return sum;
}

}  // namespace

double MapChange::largest() const { return std::max({removed, added, first, moved}); }

MapChange changeOf(const TtSdfMap& before, const TtSdfMap& after) {
  const Distances old_ones = distancesOf(before, after), new_ones = distancesOf(after, before);
  MapChange change;
  change.removed = old_ones.in_free / std::max(1.0, old_ones.points);
  change.added = new_ones.in_free / std::max(1.0, new_ones.points);
  change.first = new_ones.unknown / std::max(1.0, new_ones.points);
  change.moved = new_ones.moved / std::max(1.0, new_ones.points);
  return change;
}

}  // namespace ttsdf
