#include "field_slabs.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include "../build_steps/parallel.h"
#include "../tensor/gemm.h"
#include "../tensor/slab_parts.h"
#include "../tensor/vectorize.h"
#include "ttsdf_localization/signed_field/field_bricks.h"

namespace ttsdf {

static_assert(kSlabColumns % FieldBricks::kSide == 0, "portions of a slab begin at bricks");
namespace {

using Eigen::Index;
using Eigen::MatrixXf;

constexpr float kFar = 0.05F;      // weight at the clamp
constexpr float kUnknown = 0.01F;  // of a voxel that no ray saw
constexpr float kNear = 0.03F;     // what counts as near the surface [m]

/// Weights of n samples in a row.
TTSDF_VECTORIZE void weighColumn(const float* __restrict value, const std::uint8_t* __restrict known,
                                 const std::uint8_t* __restrict supported, int n, float scale,
                                 float* __restrict weight) {
  for (int r = 0; r < n; ++r) {
    float near = 1.0F - scale * std::abs(value[r]);
    near = near > 0.0F ? near * near : 0.0F;
    near = near > kFar ? near : kFar;
    weight[r] = (known[r] & supported[r]) != 0 ? near : kUnknown;
  }
}

void checkSizes(const SampledField& field) {
  const Dims& dims = field.geometry.dims;
  const bool fits = field.bricks
                        ? (field.bricks->dims() == dims).all()
                        : (field.values.dims() == dims).all() && field.known.size() == field.values.size();
  if (fits) return;
  std::ostringstream text;
  text << "compress: got " << field.values.size() << " values and " << field.known.size()
       << " flags for a grid of " << dims.transpose() << " voxels, wanted as many";
  throw std::invalid_argument(text.str());
}

}  // namespace

FieldSlabs::FieldSlabs(const SampledField& field, const BuildOptions& options)
    : field_(field),
      axes_(defaultModeOrder(field.geometry.dims)),
      threads_(options.threads),
      reach_(static_cast<float>(options.clamp_positive > 0.0 ? options.clamp_positive : 0.5)) {
  checkSizes(field);
}

void FieldSlabs::read(int j, int begin, Eigen::Ref<MatrixXf> values, Flags* known) const {
  const Index columns = values.cols();
  if (known) known->resize(static_cast<std::size_t>(values.size()));
  if (field_.bricks) {
    const FieldBricks::Slab slab{mode(1), j, mode(0), mode(2), begin, static_cast<int>(columns)};
    field_.bricks->readSlab(slab, values.data(), known ? known->data() : nullptr);
    return;
  }
  const Dims& dims = field_.geometry.dims;
  const auto stride = [&](int axis) {
    return axis == 0 ? Index{1} : axis == 1 ? Index{dims[0]} : Index{dims[0]} * dims[1];
  };
  using Strides = Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>;
  const Strides strides(stride(mode(2)), stride(mode(0)));
  const Index first = j * stride(mode(1)) + begin * stride(mode(2));
  values = Eigen::Map<const MatrixXf, 0, Strides>(field_.values.data() + first, size(0), columns, strides);
  if (!known) return;
  using Bytes = Eigen::Matrix<std::uint8_t, Eigen::Dynamic, Eigen::Dynamic>;
  Eigen::Map<Bytes>(known->data(), size(0), columns) =
      Eigen::Map<const Bytes, 0, Strides>(field_.known.data() + first, size(0), columns, strides);
}

SlabSource FieldSlabs::values() const {
  return [this](int j, Eigen::Ref<MatrixXf> slab) { read(j, 0, slab, nullptr); };
}

WeightedSlabSource FieldSlabs::weighted() const {
  if (field_.bricks) {
    return [this](int j, int begin, Eigen::Ref<MatrixXf> values, Eigen::Ref<MatrixXf> weights) {
      readWeighted(j, begin, values, weights);
    };
  }
  const Cache& all = cache();
  return [&all, n3 = Index{size(2)}](int j, int begin, Eigen::Ref<MatrixXf> values,
                                     Eigen::Ref<MatrixXf> weights) {
    values = all.values.middleCols(j * n3 + begin, values.cols());
    weights = all.weights.middleCols(j * n3 + begin, values.cols());
  };
}

const FieldSlabs::Cache& FieldSlabs::cache() const {
  if (!cache_) {
    auto all = std::make_unique<Cache>();
    const Index n3 = size(2);
    all->values.resize(size(0), size(1) * n3);
    all->weights.resize(size(0), size(1) * n3);
    parallelFor(size(1), threads_, [&](int j) {
      readWeighted(j, 0, all->values.middleCols(j * n3, n3), all->weights.middleCols(j * n3, n3));
    });
    cache_ = std::move(all);
  }
  return *cache_;
}

void FieldSlabs::readWeighted(int j, int begin, Eigen::Ref<MatrixXf> values,
                              Eigen::Ref<MatrixXf> weights) const {
  static thread_local Flags known;
  read(j, begin, values, &known);
  computeWeights(j, begin, values, known, weights);
}

void FieldSlabs::computeWeights(int j, int begin, const Eigen::Ref<const MatrixXf>& values,
                                const Flags& known, Eigen::Ref<MatrixXf> weights) const {
  const SupportMask& mask = field_.mask;
  Flags supported(static_cast<std::size_t>(size(0)), 1);
  for (int c = 0; c < static_cast<int>(values.cols()); ++c) {
    if (!mask.empty() && (c == 0 || (begin + c) % mask.cellVoxels() == 0)) {
      Dims cell = Dims::Zero();
      cell[mode(1)] = j / mask.cellVoxels();
      cell[mode(2)] = (begin + c) / mask.cellVoxels();
      for (int r = 0; r < size(0); r += mask.cellVoxels()) {
        cell[mode(0)] = r / mask.cellVoxels();
        std::fill_n(supported.begin() + r, std::min(mask.cellVoxels(), size(0) - r),
                    mask.at(cell[0], cell[1], cell[2]) ? std::uint8_t{1} : std::uint8_t{0});
      }
    }
    const float* value = values.data() + static_cast<Index>(c) * size(0);
    const std::uint8_t* seen = known.data() + static_cast<Index>(c) * size(0);
    float* weight = weights.data() + static_cast<Index>(c) * size(0);
    weighColumn(value, seen, supported.data(), size(0), 1.0F / reach_, weight);
  }
}

FieldError FieldSlabs::compare(const TensorTrain& train) const {
  struct Sums {
    double squares = 0.0, error = 0.0, near_error = 0.0;
    std::size_t near_count = 0;
  };
  std::vector<Sums> sums(static_cast<std::size_t>(size(1)));
  parallelFor(size(1), threads_, [&](int j) {
    static thread_local Flags known;
    MatrixXf values, approximation, half(size(0), train.rank2());
    gemm(train.first(), train.slice(j), half);
    Sums& s = sums[static_cast<std::size_t>(j)];
    overColumns(size(2), [&](int begin, int columns) {
      values.resize(size(0), columns);
      approximation.resize(size(0), columns);
      read(j, begin, values, &known);
      gemm(half, train.last().middleCols(begin, columns), approximation);
      for (Index n = 0; n < values.size(); ++n) {
        const double value = values.data()[n], d = value - static_cast<double>(approximation.data()[n]);
        s.squares += value * value;
        s.error += d * d;
        if (std::abs(values.data()[n]) > kNear || !known[static_cast<std::size_t>(n)]) continue;
        s.near_error += d * d;
        ++s.near_count;
      }
    });
  });
  Sums total;
  for (const Sums& s : sums) {
    total.squares += s.squares;
    total.error += s.error;
    total.near_error += s.near_error;
    total.near_count += s.near_count;
  }
  FieldError result;
  result.relative = total.squares > 0.0 ? std::sqrt(total.error / total.squares) : 0.0;
  result.surface =
      total.near_count > 0 ? std::sqrt(total.near_error / static_cast<double>(total.near_count)) : 0.0;
  result.total_rms = std::sqrt(total.error / static_cast<double>(field_.geometry.voxelCount()));
  return result;
}

double FieldSlabs::knownShare() const {
  std::vector<std::size_t> counts(static_cast<std::size_t>(size(1)));
  parallelFor(size(1), threads_, [&](int j) {
    static thread_local Flags known;
    static thread_local MatrixXf values;
    values.resize(size(0), size(2));
    read(j, 0, values, &known);
    counts[static_cast<std::size_t>(j)] =
        static_cast<std::size_t>(std::count(known.begin(), known.end(), std::uint8_t{1}));
  });
  const auto count = std::accumulate(counts.begin(), counts.end(), std::size_t{0});
  return static_cast<double>(count) / static_cast<double>(field_.geometry.voxelCount());
}

}  // namespace ttsdf
