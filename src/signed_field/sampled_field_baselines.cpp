#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vigra/multi_array.hxx>
#include <vigra/multi_distance.hxx>

#include "../build_steps/parallel.h"
#include "field_grid.h"
#include "ttsdf_localization/signed_field/sampled_field_methods.h"
#include "ttsdf_localization/signed_field/signed_distance.h"

namespace ttsdf {
namespace {

/// The part of the observed grid that holds band and interior plus `margin`, axes as they are.
class Window {
 public:
  Window(const ObservedGrid& observed, double margin) : observed_(observed) {
    Eigen::Array3i low = observed.dims, high = Eigen::Array3i::Constant(-1);
    forEach(observed.dims, [&](const Eigen::Array3i& v, std::size_t n) {
      if (observed.state[n] != Observation::kBand) return;
      low = low.min(v);
      high = high.max(v);
    });
    if ((high < 0).any())
      throw std::runtime_error("signed field: got no band voxel, wanted an observed surface");
    const int border = static_cast<int>(std::ceil(margin / observed.voxel_size));
    first_ = (low - border).max(0);
    geometry_.dims = (high + border).min(observed.dims - 1) - first_ + 1;
    geometry_.voxel_size = observed.voxel_size;
    geometry_.T_map_grid.translation() =
        (observed.voxel_size * (observed.origin + first_).cast<double>()).matrix();
  }

  const GridGeometry& geometry() const { return geometry_; }

  /// fn(n, m): sample n of the window is sample m of the observed grid.
  template <class Function>
  void forEachSample(const Function& fn) const {
    forEach(geometry_.dims, [&](const Eigen::Array3i& v, std::size_t n) {
      const Eigen::Array3i w = v + first_;
      fn(n, observed_.offset(w[0], w[1], w[2]));
    });
  }

 private:
  template <class Function>
  static void forEach(const Dims& dims, const Function& fn) {
    std::size_t n = 0;
    for (int k = 0; k < dims[2]; ++k) {
      for (int j = 0; j < dims[1]; ++j) {
        for (int i = 0; i < dims[0]; ++i, ++n) fn(Eigen::Array3i(i, j, k), n);
      }
    }
  }

  const ObservedGrid& observed_;
  Eigen::Array3i first_;
  GridGeometry geometry_;
};

SampledField emptyField(const GridGeometry& geometry) {
  SampledField field;
  field.geometry = geometry;
  field.values = DenseTensor(geometry.dims);
  field.known.assign(field.values.size(), 0);
  return field;
}

// Sign of an observed sample: what lies behind a surface is negative.
bool isNegative(const ObservedGrid& observed, std::size_t m) {
  const Observation state = observed.state[m];
  return state == Observation::kInterior || (state == Observation::kBand && observed.tsdf[m] < 0.0F);
}

using Marks = vigra::MultiArray<3, std::uint8_t>;

// 1 for the sample that is nearer to the zero crossing between two neighbours of the band.
std::vector<std::uint8_t> crossingSamples(const ObservedGrid& observed) {
  std::vector<std::uint8_t> marks(observed.size(), 0);
  const auto visit = [&](std::size_t a, std::size_t b) {
    if (observed.state[a] != Observation::kBand || observed.state[b] != Observation::kBand) return;
    const float fa = observed.tsdf[a], fb = observed.tsdf[b];
    if ((fa < 0.0F) != (fb < 0.0F)) marks[std::abs(fa) <= std::abs(fb) ? a : b] = 1;
  };
  for (int k = 0; k < observed.dims[2]; ++k) {
    for (int j = 0; j < observed.dims[1]; ++j) {
      for (int i = 0; i < observed.dims[0]; ++i) {
        const std::size_t m = observed.offset(i, j, k);
        if (i + 1 < observed.dims[0]) visit(m, observed.offset(i + 1, j, k));
        if (j + 1 < observed.dims[1]) visit(m, observed.offset(i, j + 1, k));
        if (k + 1 < observed.dims[2]) visit(m, observed.offset(i, j, k + 1));
      }
    }
  }
  return marks;
}

// Distance in samples to the nearest marked one.
vigra::MultiArray<3, float> distanceTo(const Marks& marks) {
  vigra::MultiArray<3, float> distance(marks.shape());
  vigra::separableMultiDistance(marks, distance, true);
  return distance;
}

vigra::Shape3 shapeOf(const Dims& dims) { return vigra::Shape3(dims[0], dims[1], dims[2]); }

}  // namespace

SampledField sampleOccupancyDistance(const ObservedGrid& observed, const BuildOptions& options,
                                     const BuildProgress& progress) {
  check(observed);
  const ProgressStep step(progress, "distance");
  const Window window(observed, options.margin);
  SampledField field = emptyField(window.geometry());
  const bool solid = options.sdf_method == "occupancy_edt_negative";
  const bool with_sign = options.sdf_method == "occupancy_edt_signed";
  const std::vector<std::uint8_t> crossings = solid ? std::vector<std::uint8_t>{} : crossingSamples(observed);
  Marks occupied(shapeOf(field.geometry.dims));
  window.forEachSample([&](std::size_t n, std::size_t m) {
    field.known[n] = observed.state[m] != Observation::kUnknown ? 1 : 0;
    occupied.data()[n] = solid ? (isNegative(observed, m) ? 1 : 0) : crossings[m];
  });
  step.report(0.1);
  const auto outside = distanceTo(occupied);
  vigra::MultiArray<3, float> inside(occupied.shape());
  step.report(0.5);
  if (solid) vigra::separableMultiDistance(occupied, inside, false);
  step.report(0.9);
  const auto voxel = static_cast<float>(observed.voxel_size);
  window.forEachSample([&](std::size_t n, std::size_t m) {
    const float distance = voxel * (outside.data()[n] - inside.data()[n]);
    field.values.data()[n] = clampedTo(options, with_sign && isNegative(observed, m) ? -distance : distance);
  });
  return field;
}

SampledField sampleTruncatedDistance(const ObservedGrid& observed, const BuildOptions& options,
                                     const BuildProgress& progress) {
  check(observed);
  const ProgressStep step(progress, "distance");
  const Window window(observed, options.margin);
  SampledField field = emptyField(window.geometry());
  Marks positive(shapeOf(field.geometry.dims)), negative(shapeOf(field.geometry.dims));
  window.forEachSample([&](std::size_t n, std::size_t m) {
    field.known[n] = observed.state[m] != Observation::kUnknown ? 1 : 0;
    if (!field.known[n]) return;
    (isNegative(observed, m) ? negative : positive).data()[n] = 1;
  });
  const auto to_positive = distanceTo(positive);
  step.report(0.4);
  const auto to_negative = distanceTo(negative);
  step.report(0.8);
  const auto truncation = static_cast<float>(observed.truncation);
  window.forEachSample([&](std::size_t n, std::size_t m) {
    float value = to_positive.data()[n] <= to_negative.data()[n] ? truncation : -truncation;
    if (observed.state[m] == Observation::kBand) value = observed.tsdf[m];
    field.values.data()[n] = clampedTo(options, value);
  });
  if (options.support_mask) {
    field.mask = supportMask(field.known, field.geometry.dims, kMaskCellVoxels);
  }
  step.report(1.0);
  return field;
}

}  // namespace ttsdf
