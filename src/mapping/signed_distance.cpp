#include "ttsdf_localization/mapping/signed_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vigra/multi_array.hxx>
#include <vigra/multi_distance.hxx>

#include "parallel.h"

namespace ttsdf {
namespace {

// A foot at the border of the observed surface counts as a projection within this slope, too: normals are
// noisy, and the further away a sample is the less an exact foot matters.
constexpr float kSidewaysSlope = 0.3F;
// Free samples beyond a border know their distance if unobserved space is not nearer than the border itself
// [voxel].
constexpr float kUnknownSlack = 3.0F;

/// Lower bound [voxel] of the distance to unknown space, on cells of two samples.
class UnknownDistance {
 public:
  UnknownDistance(const std::vector<Side>& sides, const Dims& dims) : dims_((dims + 1) / 2) {
    const vigra::Shape3 shape(dims_[0], dims_[1], dims_[2]);
    vigra::MultiArray<3, std::uint8_t> unknown(shape);
    std::size_t n = 0;
    for (int k = 0; k < dims[2]; ++k) {
      for (int j = 0; j < dims[1]; ++j) {
        for (int i = 0; i < dims[0]; ++i, ++n) {
          if (sides[n] == Side::kUnknown) unknown(i / 2, j / 2, k / 2) = 1;
        }
      }
    }
    distance_.reshape(shape);
    vigra::separableMultiDistance(unknown, distance_, true);
  }
  float at(int i, int j, int k) const { return 2.0F * distance_(i / 2, j / 2, k / 2) - 1.0F; }

 private:
  Dims dims_;
  vigra::MultiArray<3, float> distance_;
};

class Signer {
 public:
  Signer(const ObservedGrid& observed, const ObservedSurface& surface, const NearestSurface& nearest,
         const GridGeometry& geometry, const SignedDistanceOptions& options)
      : sides_(observed), surface_(surface), nearest_(nearest), geometry_(geometry), options_(options) {
    // Index of the sampled grid -> index of the observed grid.
    const double h = geometry.voxel_size;
    to_observed_ = Eigen::Translation3d(-observed.origin.cast<double>().matrix()) *
                   Eigen::Translation3d(geometry.T_map_grid.translation() / h) * geometry.T_map_grid.linear();
    side_.assign(geometry.voxelCount(), Side::kUnknown);
  }

  SignedDistance run() {
    result_.values = DenseTensor(geometry_.dims);
    result_.known.assign(side_.size(), 0);
    result_.supported.assign(side_.size(), 0);
    forEachSample([this](int i, int j, int k, std::size_t n) { decideSide({i, j, k}, n); });
    const UnknownDistance unknown(side_, geometry_.dims);
    forEachSample([this, &unknown](int i, int j, int k, std::size_t n) {
      decideValue({i, j, k}, n, unknown.at(i, j, k));
    });
    return std::move(result_);
  }

 private:
  template <class Function>
  void forEachSample(const Function& fn) {
    const Dims& dims = geometry_.dims;
    parallelFor(dims[2], options_.threads, [&](int k) {
      std::size_t n = result_.values.offset(0, 0, k);
      for (int j = 0; j < dims[1]; ++j) {
        for (int i = 0; i < dims[0]; ++i, ++n) fn(i, j, k, n);
      }
    });
  }

  void decideSide(const Eigen::Array3i& voxel, std::size_t n) {
    const Eigen::Vector3d index = voxel.cast<double>();
    const ObservedSides::Reading reading = sides_.at(to_observed_ * index);
    Side side = reading.side;
    const float distance = nearest_.distance[n];  // infinite without a triangle
    if (side != Side::kUnknown && !reading.exact && distance < 1.0F) {
      // The nearest observed sample may lie on the other side of the surface.
      side = viewSurface(surface_, nearest_.triangle[n], index.cast<float>()).along < 0.0F ? Side::kMatter
                                                                                           : Side::kFree;
    }
    if (side == Side::kMatter && distance * geometry_.voxel_size > options_.credible_depth)
      side = Side::kUnknown;
    side_[n] = side;
  }

  void decideValue(const Eigen::Array3i& voxel, std::size_t n, float unknown_distance) {
    if (nearest_.triangle[n] < 0) {
      decideFar(n, unknown_distance);
      return;
    }
    const SurfaceView view = viewSurface(surface_, nearest_.triangle[n], voxel.cast<float>());
    const float distance = nearest_.distance[n];
    const bool projects =
        !view.at_border ||
        view.sideways <= std::max(static_cast<float>(options_.support_distance / geometry_.voxel_size),
                                  kSidewaysSlope * std::abs(view.along));
    const bool certain = side_[n] == Side::kFree && unknown_distance >= distance - kUnknownSlack;
    float value = distance;
    if (side_[n] == Side::kMatter) value = -distance;
    // Unknown: the surface's plane goes on beyond its border; over its inside, the side of that plane
    // decides.
    if (side_[n] == Side::kUnknown) value = view.at_border ? view.along : std::copysign(distance, view.along);
    result_.values.data()[n] = clamped(value * static_cast<float>(geometry_.voxel_size));
    result_.known[n] = side_[n] != Side::kUnknown ? 1 : 0;
    result_.supported[n] = projects || certain ? 1 : 0;
  }

  /// No surface within the clamp: free space knows so much if unobserved space is not nearer, either; nothing
  /// is known of the rest.
  void decideFar(std::size_t n, float unknown_distance) {
    result_.values.data()[n] = static_cast<float>(options_.clamp_positive);
    result_.known[n] = side_[n] == Side::kFree ? 1 : 0;
    const float reach = static_cast<float>(options_.clamp_positive / geometry_.voxel_size);
    result_.supported[n] = side_[n] == Side::kFree && unknown_distance >= reach - kUnknownSlack ? 1 : 0;
  }

  float clamped(float metres) const {
    if (options_.clamp_negative > 0.0)
      metres = std::max(metres, -static_cast<float>(options_.clamp_negative));
    if (options_.clamp_positive > 0.0) metres = std::min(metres, static_cast<float>(options_.clamp_positive));
    return metres;
  }

  ObservedSides sides_;
  const ObservedSurface& surface_;
  const NearestSurface& nearest_;
  const GridGeometry& geometry_;
  const SignedDistanceOptions& options_;
  Eigen::Affine3d to_observed_;
  std::vector<Side> side_;
  SignedDistance result_;
};

}  // namespace

Side ObservedSides::sideOf(std::size_t n) const {
  switch (grid_.state[n]) {
    case Observation::kFree:
      return Side::kFree;
    case Observation::kInterior:
      return Side::kMatter;
    case Observation::kBand:
      return grid_.tsdf[n] < 0.0F ? Side::kMatter : Side::kFree;
    case Observation::kUnknown:
      break;
  }
  return Side::kUnknown;
}

ObservedSides::Reading ObservedSides::at(const Eigen::Vector3d& index) const {
  const Eigen::Array3i nearest = (index.array() + 0.5).floor().cast<int>();
  if ((nearest < 0).any() || (nearest >= grid_.dims).any()) return {};
  const Side side = sideOf(grid_.offset(nearest[0], nearest[1], nearest[2]));
  constexpr double kOnSample = 1e-4;
  return {side, (index.array() - nearest.cast<double>()).abs().maxCoeff() < kOnSample};
}

SurfaceView viewSurface(const ObservedSurface& surface, std::int32_t triangle, const Eigen::Vector3f& index) {
  const Eigen::Vector3i t = surface.mesh.triangles.col(triangle);
  const auto& vertices = surface.mesh.vertices;
  const TriangleFoot foot = closestPoint(index, vertices.col(t[0]), vertices.col(t[1]), vertices.col(t[2]));
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  SurfaceView view;
  const int zeros = static_cast<int>((foot.weights.array() <= 0.0F).count());
  for (int c = 0; c < 3; ++c) {
    normal += foot.weights[c] * surface.normals.col(t[c]);
    if (zeros == 2 && foot.weights[c] > 0.0F)
      view.at_border = surface.border_vertex[static_cast<std::size_t>(t[c])] != 0;
    // The edge opposite to corner c is edge c + 1.
    if (zeros == 1 && foot.weights[c] <= 0.0F) {
      view.at_border =
          ((surface.border_edges[static_cast<std::size_t>(triangle)] >> ((c + 1) % 3)) & 1U) != 0;
    }
  }
  const float length = normal.norm();
  if (length > 0.0F) normal /= length;
  const Eigen::Vector3f way = index - foot.point;
  view.foot = foot.point;
  view.along = normal.dot(way);
  view.sideways = (way - view.along * normal).norm();
  return view;
}

SignedDistance signedDistance(const ObservedGrid& observed, const ObservedSurface& surface,
                              const NearestSurface& nearest, const GridGeometry& geometry,
                              const SignedDistanceOptions& options) {
  return Signer(observed, surface, nearest, geometry, options).run();
}

SupportMask supportMask(const std::vector<std::uint8_t>& supported, const Dims& dims, int cell_voxels) {
  SupportMask mask(dims, cell_voxels, false);
  const Dims& cells = mask.cellDims();
  std::vector<int> balance(static_cast<std::size_t>(cells.prod()), 0);
  std::size_t n = 0;
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      int* row =
          balance.data() + static_cast<std::size_t>(cells[0]) *
                               static_cast<std::size_t>(j / cell_voxels + cells[1] * (k / cell_voxels));
      for (int i = 0; i < dims[0]; ++i, ++n) row[i / cell_voxels] += supported[n] ? 1 : -1;
    }
  }
  std::size_t cell = 0;
  for (int c = 0; c < cells[2]; ++c) {
    for (int b = 0; b < cells[1]; ++b) {
      for (int a = 0; a < cells[0]; ++a, ++cell) {
        if (balance[cell] >= 0) mask.set(a, b, c, true);
      }
    }
  }
  return mask;
}

}  // namespace ttsdf
