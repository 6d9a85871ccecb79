#pragma once
// The maps of an AtlasField with their poses and boxes in single precision.

#include <vector>

#include "ttsdf_localization/atlas/atlas_field.h"
#include "ttsdf_localization/atlas/oriented_box.h"

namespace ttsdf {

/// Points of a piece of a span, so that what is kept about them fits on the stack.
constexpr int kAtlasPiece = 256;

/// One of the maps: from points relative to the atlas field's origin to those its own field wants, and back.
struct AtlasMember {
  const DistanceField* field;
  const DistanceField* far;
  Eigen::Isometry3f T_field_atlas;  ///< both relative to their origins
  Eigen::Isometry3f T_box_atlas;    ///< the box is [0, size]
  Eigen::Vector3f size;             ///< [m]
  Eigen::AlignedBox3f bounds;       ///< of the box, relative to the atlas field's origin

  /// Distance to the border of the box [m], positive inside.
  float depth(const Eigen::Vector3f& p) const {
    const Eigen::Vector3f q = T_box_atlas * p, inside = q.cwiseMin(size - q);
    const float least = inside.minCoeff();
    return least >= 0.0F ? least : -inside.cwiseMin(0.0F).norm();
  }
  /// The same of up to kAtlasPiece points, several at a time; outside: any number below 0 (NaN: NaN).
  void depthsInside(const PointSpan& points, int begin, int count, float* depths) const {
    const Eigen::Matrix3f R = T_box_atlas.linear();
    const Eigen::Vector3f t = T_box_atlas.translation();
    const float *const x = points.x + begin, *const y = points.y + begin, *const z = points.z + begin;
    const auto least = [](float a, float b) { return a < b ? a : b; };
    for (int axis = 0; axis < 3; ++axis) {
      const float rx = R(axis, 0), ry = R(axis, 1), rz = R(axis, 2), from = t[axis], side = size[axis];
      if (axis == 0) {
        for (int n = 0; n < count; ++n) {
          const float q = rx * x[n] + ry * y[n] + rz * z[n] + from;
          depths[n] = least(q, side - q);
        }
      } else {
        for (int n = 0; n < count; ++n) {
          const float q = rx * x[n] + ry * y[n] + rz * z[n] + from;
          depths[n] = least(least(q, side - q), depths[n]);
        }
      }
    }
  }
};

/// A few points of a piece, put together for one map.
struct AtlasBatch {
  int size = 0;
  int point[kAtlasPiece];  ///< of the piece
  float x[kAtlasPiece], y[kAtlasPiece], z[kAtlasPiece];
  float value[kAtlasPiece], gx[kAtlasPiece], gy[kAtlasPiece], gz[kAtlasPiece];
  PointState state[kAtlasPiece];

  void add(const AtlasMember& member, int n, const Eigen::Vector3f& p) {
    const Eigen::Vector3f q = member.T_field_atlas * p;
    point[size] = n;
    x[size] = q.x(), y[size] = q.y(), z[size] = q.z();
    ++size;
  }
  void evaluate(const DistanceField& field) {
    field.evaluate(PointSpan{x, y, z, size}, SampleSpan{value, gx, gy, gz, state});
  }
  /// Answer `k` goes to sample `n`, its gradient turned into the atlas' frame.
  void writeSample(const AtlasMember& member, int k, const SampleSpan& samples, int n) const {
    const Eigen::Vector3f g =
        member.T_field_atlas.linear().transpose() * Eigen::Vector3f(gx[k], gy[k], gz[k]);
    samples.value[n] = value[k];
    samples.gradient_x[n] = g.x(), samples.gradient_y[n] = g.y(), samples.gradient_z[n] = g.z();
    samples.state[n] = state[k];
  }
};

/// The box of a map that is not here, relative to the atlas field's origin.
struct AbsentBox {
  Eigen::Isometry3f T_box_atlas;  ///< the box is [0, size]
  Eigen::Vector3f size;           ///< [m]
  bool holds(const Eigen::Vector3f& p) const {
    const Eigen::Vector3f q = T_box_atlas * p;
    return (q.array() >= 0.0F).all() && (q.array() <= size.array()).all();
  }
};

inline void setOutside(const SampleSpan& samples, int n) {
  samples.value[n] = samples.gradient_x[n] = samples.gradient_y[n] = samples.gradient_z[n] = 0.0F;
  samples.state[n] = PointState::kOutside;
}

/// What a map answers for, in the atlas' frame.
OrientedBox boxInAtlas(const PlacedField& map);
/// Index of the map whose border is furthest from a place, inside before outside; the first of equals.
std::size_t deepestOf(const std::vector<PlacedField>& maps, const Eigen::Vector3d& p_atlas);

class AtlasField::Members {
 public:
  Members(std::vector<PlacedField> placed, const std::vector<OrientedBox>& absent_boxes);

  /// The member that holds a point deepest, the first of equals; -1: none holds it.
  int deepest(const Eigen::Vector3f& p) const;

  std::vector<PlacedField> maps;
  std::vector<AtlasMember> members;
  std::vector<AbsentBox> absent;
  GridGeometry geometry;
};

}  // namespace ttsdf
