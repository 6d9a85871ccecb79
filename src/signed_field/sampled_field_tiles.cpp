#include "sampled_field_tiles.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>

#include "../build_steps/parallel.h"
#include "field_grid.h"
#include "surface_survey.h"
#include "ttsdf_localization/fusion/tsdf_volume_grids.h"
#include "ttsdf_localization/signed_field/field_bricks.h"
#include "ttsdf_localization/signed_field/sampled_field_methods.h"
#include "ttsdf_localization/signed_field/signed_distance.h"

namespace ttsdf {
namespace {

constexpr int kFieldTileSide = 128;
// Beyond the reach of a value [voxel]: sharpening and smoothing of the surface look three rings of vertices
// far, a jump of the sign four samples.
constexpr int kSurfaceHalo = 7, kValueHalo = 6;

class TileSampler {
 public:
  TileSampler(const TsdfVolume& volume, const BuildOptions& options, SampledField& field, FieldBricks& bricks)
      : volume_(volume), field_(field), bricks_(bricks) {
    const double h = volume.options().voxel_size;
    nearest_.threads = 1;
    nearest_.exact_within = nearest_.none_beyond = exactRange(options, h);
    sign_.support_distance = options.support_distance;
    sign_.clamp_negative = options.clamp_negative;
    sign_.clamp_positive = options.clamp_positive;
    sign_.credible_depth = volume.options().truncation + 1.5 * h;
    sign_.threads = 1;
    // Even: half-resolution lattices of the tiles then coincide.
    halo_ = (static_cast<int>(std::ceil(nearest_.exact_within)) + kSurfaceHalo + 1) / 2 * 2;
  }

  /// Safe to call from several threads for boxes that do not overlap.
  void sample(const Tiling::Box& core) {
    const Dims begin = (core.begin - halo_).max(0);
    GridGeometry geometry = field_.geometry;
    geometry.dims = (core.begin + core.size + halo_).min(field_.geometry.dims) - begin;
    geometry.T_map_grid.translation() = field_.geometry.samplePosition(begin.cast<double>().matrix());
    ObservedSurface surface;
    std::vector<SideReading> sides;
    {
      const ObservedGrid observed = observe(geometry);
      const bool seen = std::any_of(observed.state.begin(), observed.state.end(),
                                    [](Observation state) { return state != Observation::kUnknown; });
      if (!seen) return;  // as the bricks are from the start
      surface = observedSurface(observed, kMinSurfacePiece, 1, true);
      sides = readSides(observed, geometry, 1);
    }
    toIndexCoordinates(surface, geometry);
    const Tiling::Box inner{core.begin - begin, core.size};
    SignedDistance distance = measure(std::move(sides), surface, geometry, inner);
    const std::vector<std::uint8_t> loose = looseSamples(distance, geometry.voxel_size, 1);
    store(core, inner, distance, loose);
  }

 private:
  /// What was observed around the samples of a grid.
  ObservedGrid observe(const GridGeometry& geometry) const {
    Eigen::AlignedBox3d box;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Array3i index(corner & 1, (corner >> 1) & 1, corner >> 2);
      const Eigen::Vector3d p =
          geometry.samplePosition((index * (geometry.dims - 1)).cast<double>().matrix());
      box.extend(Eigen::Vector3d(p / geometry.voxel_size));
    }
    constexpr double kBorder = 2.5;  // every crossing then has its four cells
    const Eigen::Array3i low = (box.min().array() - kBorder).floor().cast<int>();
    const Eigen::Array3i high = (box.max().array() + kBorder).ceil().cast<int>();
    return observedGrid(volume_, low, high - low + 1, 1);
  }

  SignedDistance measure(std::vector<SideReading> sides, const ObservedSurface& surface,
                         const GridGeometry& geometry, const Tiling::Box& inner) const {
    NearestSurface nearest;
    {
      const std::vector<std::uint8_t> wanted = wantedSamples(sides, geometry.dims, inner);
      NearestSurfaceOptions options = nearest_;
      options.wanted = &wanted;
      nearest = nearestSurface(surface.mesh, geometry.dims, options);
    }
    return signedDistance(std::move(sides), surface, nearest, geometry, sign_);
  }

  /// The core with what jumps of the sign look at, and all matter: where it lies too deep it is unknown.
  static std::vector<std::uint8_t> wantedSamples(const std::vector<SideReading>& sides, const Dims& dims,
                                                 const Tiling::Box& inner) {
    const Dims low = inner.begin - kValueHalo, high = inner.begin + inner.size + kValueHalo;
    std::vector<std::uint8_t> wanted(sides.size());
    std::size_t n = 0;
    for (int k = 0; k < dims[2]; ++k) {
      for (int j = 0; j < dims[1]; ++j) {
        const bool row_inside = k >= low[2] && k < high[2] && j >= low[1] && j < high[1];
        for (int i = 0; i < dims[0]; ++i, ++n) {
          const bool inside = row_inside && i >= low[0] && i < high[0];
          wanted[n] = inside || sides[n].side == Side::kMatter ? 1 : 0;
        }
      }
    }
    return wanted;
  }

  void store(const Tiling::Box& core, const Tiling::Box& inner, const SignedDistance& distance,
             const std::vector<std::uint8_t>& loose) {
    const DenseTensor& values = distance.values;
    const auto first =
        static_cast<std::ptrdiff_t>(values.offset(inner.begin[0], inner.begin[1], inner.begin[2]));
    FieldBricks::Samples samples{
        values.data() + first, distance.known.data() + first, loose.data() + first, {}};
    samples.strides << 1, static_cast<std::ptrdiff_t>(values.offset(0, 1, 0)),
        static_cast<std::ptrdiff_t>(values.offset(0, 0, 1));
    bricks_.store(core.begin, core.size, samples);
    if (field_.mask.empty()) return;
    std::vector<std::uint8_t> supported;
    supported.reserve(static_cast<std::size_t>(core.size.prod()));
    for (int k = 0; k < core.size[2]; ++k) {
      for (int j = 0; j < core.size[1]; ++j) {
        const auto row = distance.supported.begin() + first + j * samples.strides[1] + k * samples.strides[2];
        supported.insert(supported.end(), row, row + core.size[0]);
      }
    }
    storeMask(core.begin / kMaskCellVoxels, supportMask(supported, core.size, kMaskCellVoxels));
  }

  void storeMask(const Dims& first, const SupportMask& part) {
    const std::lock_guard<std::mutex> lock(mask_guard_);  // cells of two tiles may share a word
    const Dims& cells = part.cellDims();
    for (int c = 0; c < cells[2]; ++c) {
      for (int b = 0; b < cells[1]; ++b) {
        for (int a = 0; a < cells[0]; ++a)
          field_.mask.set(first[0] + a, first[1] + b, first[2] + c, part.at(a, b, c));
      }
    }
  }

  const TsdfVolume& volume_;
  SampledField& field_;
  FieldBricks& bricks_;
  NearestSurfaceOptions nearest_;
  SignedDistanceOptions sign_;
  int halo_ = 0;
  std::mutex mask_guard_;
};

}  // namespace

bool needsTiles(const TsdfVolume& volume, const BuildOptions& options) {
  if (options.field != "sdf" || options.sdf_method != "surface" || volume.empty()) return false;
  if (options.clamp_negative <= 0.0 || options.clamp_positive <= 0.0) return false;
  openvdb::CoordBBox box = volume.grids().tsdf->evalActiveVoxelBoundingBox();
  box.expand(static_cast<int>(std::ceil(options.margin / volume.options().voxel_size)));
  return box.volume() > static_cast<openvdb::Index64>(options.max_dense_voxels);
}

SampledField sampleSurfaceTiles(const TsdfVolume& volume, const BuildOptions& options,
                                const BuildProgress& progress) {
  SampledField field;
  {
    const ProgressStep step(progress, "surface");
    field.geometry = surveyGrid(volume, options, step);
  }
  const ProgressStep step(progress, "distance");
  const auto bricks =
      std::make_shared<FieldBricks>(field.geometry.dims, -static_cast<float>(options.clamp_negative),
                                    static_cast<float>(options.clamp_positive));
  if (options.support_mask) field.mask = SupportMask(field.geometry.dims, kMaskCellVoxels, false);
  TileSampler sampler(volume, options, field, *bricks);
  const Tiling tiling(field.geometry.dims, kFieldTileSide);
  parallelFor(tiling.count(), options.threads, step, [&](int number) { sampler.sample(tiling.box(number)); });
  bricks->fillLoose(options.threads);
  field.bricks = bricks;
  return field;
}

}  // namespace ttsdf
