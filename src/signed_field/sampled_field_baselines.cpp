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

}  // namespace

SampledField sampleOccupancyDistance(const ObservedGrid& observed, const BuildOptions& options,
                                     const BuildProgress& progress) {
  check(observed);
  const ProgressStep step(progress, "distance");
  const Window window(observed, options.margin);
  SampledField field = emptyField(window.geometry());
  const Dims& dims = field.geometry.dims;
  const vigra::Shape3 shape(dims[0], dims[1], dims[2]);
  vigra::MultiArray<3, std::uint8_t> occupied(shape);
  window.forEachSample([&](std::size_t n, std::size_t m) {
    const Observation state = observed.state[m];
    field.known[n] = state != Observation::kUnknown ? 1 : 0;
    occupied.data()[n] =
        state == Observation::kInterior || (state == Observation::kBand && observed.tsdf[m] < 0.0F) ? 1 : 0;
  });
  step.report(0.1);
  vigra::MultiArray<3, float> outside(shape), inside(shape);
  vigra::separableMultiDistance(occupied, outside, true);
  step.report(0.5);
  vigra::separableMultiDistance(occupied, inside, false);
  step.report(0.9);
  for (std::size_t n = 0; n < field.values.size(); ++n) {
    field.values.data()[n] =
        clampedTo(options, static_cast<float>(observed.voxel_size) * (outside.data()[n] - inside.data()[n]));
  }
  return field;
}

SampledField sampleTruncatedDistance(const ObservedGrid& observed, const BuildOptions& options,
                                     const BuildProgress& progress) {
  check(observed);
  const ProgressStep step(progress, "distance");
  const Window window(observed, options.margin);
  SampledField field = emptyField(window.geometry());
  const auto truncation = static_cast<float>(observed.truncation);
  window.forEachSample([&](std::size_t n, std::size_t m) {
    const Observation state = observed.state[m];
    field.known[n] = state != Observation::kUnknown ? 1 : 0;
    float value = truncation;
    if (state == Observation::kBand) value = observed.tsdf[m];
    if (state == Observation::kInterior) value = -truncation;
    field.values.data()[n] = clampedTo(options, value);
  });
  if (options.support_mask) {
    field.mask = supportMask(field.known, field.geometry.dims, kMaskCellVoxels);
  }
  step.report(1.0);
  return field;
}

}  // namespace ttsdf
