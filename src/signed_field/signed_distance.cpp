#include "ttsdf_localization/signed_field/signed_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vigra/multi_array.hxx>
#include <vigra/multi_distance.hxx>

#include "../build_steps/parallel.h"

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
  UnknownDistance(const std::vector<SideReading>& sides, const Dims& dims) : dims_((dims + 1) / 2) {
    const vigra::Shape3 shape(dims_[0], dims_[1], dims_[2]);
    vigra::MultiArray<3, std::uint8_t> unknown(shape);
    std::size_t n = 0;
    for (int k = 0; k < dims[2]; ++k) {
      for (int j = 0; j < dims[1]; ++j) {
        std::uint8_t* row = unknown.data() + rowOffset(j, k);
        for (int i = 0; i < dims[0]; ++i, ++n) {
          if (sides[n].side == Side::kUnknown) row[i / 2] = 1;
        }
      }
    }
    distance_.reshape(shape);
    vigra::separableMultiDistance(unknown, distance_, true);
  }

  /// Of one row of samples.
  class Row {
   public:
    explicit Row(const float* cells) : cells_(cells) {}
    float at(int i) const { return 2.0F * cells_[i / 2] - 1.0F; }

   private:
    const float* cells_;
  };
  Row row(int j, int k) const { return Row(distance_.data() + rowOffset(j, k)); }

 private:
  std::ptrdiff_t rowOffset(int j, int k) const {
    return static_cast<std::ptrdiff_t>(dims_[0]) * (j / 2 + static_cast<std::ptrdiff_t>(dims_[1]) * (k / 2));
  }

  Dims dims_;
  vigra::MultiArray<3, float> distance_;
};

/// 1 for triangles on which a foot may lie at the border of the surface.
std::vector<std::uint8_t> trianglesAtBorder(const ObservedSurface& surface) {
  std::vector<std::uint8_t> at_border = surface.border_edges;
  for (std::size_t n = 0; n < at_border.size(); ++n) {
    const Eigen::Vector3i t = surface.mesh.triangles.col(static_cast<Eigen::Index>(n));
    for (int c = 0; c < 3; ++c) at_border[n] |= surface.border_vertex[static_cast<std::size_t>(t[c])];
  }
  return at_border;
}

class Signer {
 public:
  Signer(std::vector<SideReading> sides, const ObservedSurface& surface, const NearestSurface& nearest,
         const GridGeometry& geometry, const SignedDistanceOptions& options)
      : sides_(std::move(sides)),
        surface_(surface),
        nearest_(nearest),
        geometry_(geometry),
        options_(options),
        at_border_(trianglesAtBorder(surface)),
        voxel_size_(static_cast<float>(geometry.voxel_size)),
        support_(static_cast<float>(options.support_distance / geometry.voxel_size)),
        reach_(static_cast<float>(options.clamp_positive / geometry.voxel_size)) {
    if (sides_.size() == geometry.voxelCount()) return;
    throw std::invalid_argument("signed distance: got sides of " + std::to_string(sides_.size()) +
                                " samples, wanted " + std::to_string(geometry.voxelCount()));
  }

  SignedDistance run() {
    result_.values = DenseTensor(geometry_.dims);
    result_.known.assign(sides_.size(), 0);
    result_.supported.assign(sides_.size(), 0);
    forEachRow([this](int j, int k, std::size_t begin) {
      for (int i = 0; i < geometry_.dims[0]; ++i) decideSide(i, j, k, begin + static_cast<std::size_t>(i));
    });
    const UnknownDistance unknown(sides_, geometry_.dims);
    forEachRow([this, &unknown](int j, int k, std::size_t begin) {
      const UnknownDistance::Row row = unknown.row(j, k);
      for (int i = 0; i < geometry_.dims[0]; ++i) {
        const std::size_t n = begin + static_cast<std::size_t>(i);
        if (nearest_.triangle[n] < 0) {
          decideFar(n, row.at(i));
        } else {
          decideNear({i, j, k}, n, row.at(i));
        }
      }
    });
    return std::move(result_);
  }

 private:
  template <class Function>
  void forEachRow(const Function& fn) {
    const Dims& dims = geometry_.dims;
    parallelFor(dims[2], options_.threads, [&](int k) {
      for (int j = 0; j < dims[1]; ++j) fn(j, k, result_.values.offset(0, j, k));
    });
  }

  void decideSide(int i, int j, int k, std::size_t n) {
    const SideReading reading = sides_[n];
    if (reading.side == Side::kUnknown) return;
    const float distance = nearest_.distance[n];  // infinite without a triangle
    Side side = reading.side;
    if (!reading.exact && distance < 1.0F) {
      // The nearest observed sample may lie on the other side of the surface.
      const Eigen::Vector3f index = Eigen::Array3i(i, j, k).cast<float>();
      side = viewSurface(surface_, nearest_.triangle[n], index).along < 0.0F ? Side::kMatter : Side::kFree;
    }
    if (side == Side::kMatter && distance * geometry_.voxel_size > options_.credible_depth)
      side = Side::kUnknown;
    sides_[n].side = side;
  }

  void decideNear(const Eigen::Array3i& voxel, std::size_t n, float unknown_distance) {
    const Side side = sides_[n].side;
    const float distance = nearest_.distance[n];
    const bool certain = side == Side::kFree && unknown_distance >= distance - kUnknownSlack;
    const bool interior = at_border_[static_cast<std::size_t>(nearest_.triangle[n])] == 0;
    float value = side == Side::kMatter ? -distance : distance;
    bool projects = true;
    if (side == Side::kUnknown || !(certain || interior)) {
      const SurfaceView view = viewSurface(surface_, nearest_.triangle[n], voxel.cast<float>());
      projects =
          !view.at_border || view.sideways <= std::max(support_, kSidewaysSlope * std::abs(view.along));
      // Unknown: the surface's plane goes on beyond its border; over its inside, the side of that plane
      // decides.
      if (side == Side::kUnknown) value = view.at_border ? view.along : std::copysign(distance, view.along);
    }
    result_.values.data()[n] = clamped(value * voxel_size_);
    result_.known[n] = side != Side::kUnknown ? 1 : 0;
    result_.supported[n] = projects || certain ? 1 : 0;
  }

  /// No surface within the clamp: free space knows so much if unobserved space is not nearer, either; nothing
  /// is known of the rest.
  void decideFar(std::size_t n, float unknown_distance) {
    const bool is_free = sides_[n].side == Side::kFree;
    result_.values.data()[n] = static_cast<float>(options_.clamp_positive);
    result_.known[n] = is_free ? 1 : 0;
    result_.supported[n] = is_free && unknown_distance >= reach_ - kUnknownSlack ? 1 : 0;
  }

  float clamped(float metres) const {
    if (options_.clamp_negative > 0.0)
      metres = std::max(metres, -static_cast<float>(options_.clamp_negative));
    if (options_.clamp_positive > 0.0) metres = std::min(metres, static_cast<float>(options_.clamp_positive));
    return metres;
  }

  std::vector<SideReading> sides_;
  const ObservedSurface& surface_;
  const NearestSurface& nearest_;
  const GridGeometry& geometry_;
  const SignedDistanceOptions& options_;
  std::vector<std::uint8_t> at_border_;  // per triangle
  float voxel_size_, support_, reach_;   // [m], [voxel], [voxel]
  SignedDistance result_;
};

}  // namespace

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

SignedDistance signedDistance(std::vector<SideReading> sides, const ObservedSurface& surface,
                              const NearestSurface& nearest, const GridGeometry& geometry,
                              const SignedDistanceOptions& options) {
  return Signer(std::move(sides), surface, nearest, geometry, options).run();
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
