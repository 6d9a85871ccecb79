#include "ttsdf_localization/tools/map_edit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace ttsdf {

namespace {

constexpr double kMaxVoxels = 2147483648.0;

std::string text(const Dims& dims) {
  std::ostringstream out;
  out << dims.transpose();
  return out.str();
}

/// Box of continuous indices that a box of another frame covers.
Eigen::AlignedBox3d indexBox(const GridGeometry& geometry, const Eigen::AlignedBox3d& box,
                             const Eigen::Isometry3d& T) {
  Eigen::AlignedBox3d indices;
  for (int corner = 0; corner < 8; ++corner) {
    indices.extend(geometry.toIndex(T * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner))));
  }
  return indices;
}

SupportMask croppedMask(const SupportMask& mask, const Dims& begin, const Dims& size) {
  if (mask.empty()) return mask;
  SupportMask result(size, mask.cellVoxels(), false);
  const Dims first = begin / mask.cellVoxels();
  for (int c = 0; c < result.cellDims()[2]; ++c) {
    for (int b = 0; b < result.cellDims()[1]; ++b) {
      for (int a = 0; a < result.cellDims()[0]; ++a) {
        if (mask.at(first[0] + a, first[1] + b, first[2] + c)) result.set(a, b, c, true);
      }
    }
  }
  return result;
}

/// One of the maps to merge, asked at points of the common frame.
class Layer {
 public:
  Layer(const TtSdfMap& map, const Eigen::Isometry3d& T_map_common)
      : field_(makeField(map)), T_map_common_(T_map_common) {}

  const FieldSamples& ask(const Eigen::Matrix3Xd& points_common) {
    const Eigen::Isometry3d T = relativeTo(field_->geometry(), T_map_common_);
    samples_ = field_->evaluate(
        Eigen::Matrix3Xf(((T.linear() * points_common).colwise() + T.translation()).cast<float>()));
    return samples_;
  }

 private:
  std::unique_ptr<TtDistanceField> field_;
  Eigen::Isometry3d T_map_common_;
  FieldSamples samples_;
};

/// The merged field, slab by slab, and where it is known.
class Merger {
 public:
  Merger(const TtSdfMap& a, const TtSdfMap& b, const Eigen::Isometry3d& T_a_b, const GridGeometry& geometry,
         SupportMask& mask)
      : first_(a, Eigen::Isometry3d::Identity()),
        second_(b, T_a_b.inverse()),
        geometry_(geometry),
        mask_(mask),
        axes_(defaultModeOrder(geometry.dims)),
        // Free space far from any surface, as far as the maps can tell.
        far_(static_cast<float>(a.clamp_positive > 0.0 ? a.clamp_positive
                                                       : std::max(a.truncation, a.geometry.voxel_size))) {}

  void fill(int j, Eigen::Ref<Eigen::MatrixXf> slab) {
    Eigen::Matrix3Xd points(3, slab.rows());
    for (Eigen::Index k = 0; k < slab.cols(); ++k) {
      for (Eigen::Index i = 0; i < slab.rows(); ++i) {
        points.col(i) =
            geometry_.samplePosition(index(static_cast<int>(i), j, static_cast<int>(k)).cast<double>());
      }
      const FieldSamples& a = first_.ask(points);
      const FieldSamples& b = second_.ask(points);
      for (Eigen::Index i = 0; i < slab.rows(); ++i) {
        const auto n = static_cast<std::size_t>(i);
        slab(i, k) = choose(a.values[i], a.states[n], b.values[i], b.states[n]);
        if (a.states[n] != PointState::kValid && b.states[n] != PointState::kValid) continue;
        const Eigen::Vector3i cell = index(static_cast<int>(i), j, static_cast<int>(k)) / mask_.cellVoxels();
        mask_.set(cell[0], cell[1], cell[2], true);
      }
    }
  }

 private:
  Eigen::Vector3i index(int i, int j, int k) const {
    Eigen::Vector3i result;
    result[axes_[0]] = i;
    result[axes_[1]] = j;
    result[axes_[2]] = k;
    return result;
  }

  float choose(float a, PointState state_a, float b, PointState state_b) const {
    if (state_a == state_b && state_a != PointState::kOutside) return std::abs(a) < std::abs(b) ? a : b;
    if (state_a == PointState::kValid) return a;
    if (state_b == PointState::kValid) return b;
    if (state_a == PointState::kUnknown) return a;
    if (state_b == PointState::kUnknown) return b;
    return far_;
  }

  Layer first_, second_;
  const GridGeometry& geometry_;
  SupportMask& mask_;
  ModeOrder axes_;
  float far_;
};

/// Grid of the first map, grown to hold both.
GridGeometry commonGeometry(const TtSdfMap& a, const TtSdfMap& b, const Eigen::Isometry3d& T_a_b) {
  const Eigen::Vector3d last_b = b.geometry.voxel_size * (b.geometry.dims - 1).cast<double>().matrix();
  Eigen::AlignedBox3d box =
      indexBox(a.geometry, {Eigen::Vector3d::Zero(), last_b}, T_a_b * b.geometry.T_map_grid);
  box.extend(Eigen::Vector3d::Zero());
  box.extend((a.geometry.dims - 1).cast<double>().matrix());
  const Eigen::Vector3d low = (box.min().array() + 1e-6).floor().matrix(),
                        high = (box.max().array() - 1e-6).ceil().matrix();
  const Eigen::Vector3d size = high - low + Eigen::Vector3d::Ones();
  if (!(size.prod() < kMaxVoxels)) {
    throw std::invalid_argument("merge: got a common box of " + std::to_string(size.prod()) +
                                " voxels, wanted fewer than 2^31: are the maps far apart?");
  }
  GridGeometry geometry = a.geometry;
  geometry.dims = size.cast<int>().array();
  geometry.T_map_grid.translation() = a.geometry.samplePosition(low);
  return geometry;
}

}  // namespace

TtSdfMap recompressed(const TtSdfMap& map, const TtSvdOptions& options) {
  TtSdfMap result = map;
  result.train = round(map.train, options);
  return result;
}

TtSdfMap cropped(const TtSdfMap& map, const Eigen::AlignedBox3d& box_map) {
  if (box_map.isEmpty())
    throw std::invalid_argument("crop: got an empty box, wanted min < max on every axis");
  const Eigen::AlignedBox3d box = indexBox(map.geometry, box_map, Eigen::Isometry3d::Identity());
  const Dims last = map.geometry.dims - 1;
  if ((box.max().array() < 0.0).any() || (box.min().array() > last.cast<double>()).any()) {
    throw std::invalid_argument("crop: got a box outside the map of " + text(map.geometry.dims) + " voxels");
  }
  const int cell = map.mask.empty() ? 1 : map.mask.cellVoxels();
  const auto clampedIndex = [&last](const Eigen::Array3d& index) -> Dims {
    return index.max(0.0).min(last.cast<double>()).cast<int>();
  };
  Dims begin = clampedIndex(box.min().array().floor()) / cell * cell;
  const Dims end = clampedIndex(box.max().array().ceil());
  begin = begin.min((last - 1).max(0) / cell * cell);
  const Dims size = (end - begin + 1).max(2).min(map.geometry.dims - begin);
  TtSdfMap result = map;
  result.train = round(crop(map.train, begin, size), {});  // a part may need fewer ranks than the whole
  result.geometry.dims = size;
  result.geometry.T_map_grid.translation() = map.geometry.samplePosition(begin.cast<double>().matrix());
  result.mask = croppedMask(map.mask, begin, size);
  return result;
}

TtSdfMap merged(const TtSdfMap& a, const TtSdfMap& b, const Eigen::Isometry3d& T_a_b,
                const TtSvdOptions& options) {
  if (a.kind != b.kind) {
    throw std::invalid_argument(std::string("merge: got a map of kind ") + name(a.kind) +
                                " and one of kind " + name(b.kind) + ", wanted the same");
  }
  TtSdfMap result;
  result.geometry = commonGeometry(a, b, T_a_b);
  result.kind = a.kind;
  result.truncation = std::min(a.truncation, b.truncation);
  result.clamp_negative = std::max(a.clamp_negative, b.clamp_negative);
  result.clamp_positive = std::max(a.clamp_positive, b.clamp_positive);
  result.frame_id = a.frame_id;
  result.metadata = a.metadata;
  result.metadata.erase("build_report");
  const int cell = a.mask.empty() ? (b.mask.empty() ? 4 : b.mask.cellVoxels()) : a.mask.cellVoxels();
  result.mask = SupportMask(result.geometry.dims, cell, false);
  Merger merger(a, b, T_a_b, result.geometry, result.mask);
  TtSvdOptions with_axes = options;
  with_axes.axes = defaultModeOrder(result.geometry.dims);
  result.train = ttSvd(
                     result.geometry.dims,
                     [&merger](int j, Eigen::Ref<Eigen::MatrixXf> slab) { merger.fill(j, slab); }, with_axes)
                     .train;
  return result;
}

}  // namespace ttsdf
