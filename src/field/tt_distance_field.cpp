#include "ttsdf_localization/field/tt_distance_field.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <mutex>
#include <shared_mutex>
#include <sstream>
#include <stdexcept>

#include "../tensor/vectorize.h"
#include "block_cache.h"
#include "brick_decoder.h"
#include "grid_field.h"

namespace ttsdf {

namespace {

constexpr int kLayer = kBrickSide * kBrickSide;
constexpr float kWarmVoxels = 8.0f;  // what scans pass through from a usual prior

/// Brick of every cell of a chunk, and the place of the cell's first corner in it.
struct BrickChunk {
  alignas(64) std::uint32_t brick[kChunk];
  alignas(64) std::int32_t offset[kChunk];
};

TTSDF_VECTORIZE void locateBricks(const CellChunk& cells, int bricks_a, int bricks_b, BrickChunk& out) {
  for (int n = 0; n < cells.size; ++n) {
    const std::int32_t i = cells.cell[0][n], j = cells.cell[1][n], k = cells.cell[2][n];
    const std::int32_t a = i / kBrickCells, b = j / kBrickCells, c = k / kBrickCells;
    out.brick[n] = static_cast<std::uint32_t>(a + bricks_a * (b + bricks_b * c));
    out.offset[n] = i - kBrickCells * a + kBrickSide * (j - kBrickCells * b) + kLayer * (k - kBrickCells * c);
  }
}

/// Numbers of the points' bricks; false if one is missing.
TTSDF_VECTORIZE bool lookUp(const std::uint32_t* places, const BrickChunk& where, int size,
                            std::uint32_t* number) {
  std::uint32_t missing = 0;
  TTSDF_INDEPENDENT
  for (int n = 0; n < size; ++n) {
    const std::uint32_t place = places[where.brick[n]];
    missing |= place == 0 ? 1u : 0u;
    number[n] = place - 1;
  }
  return missing == 0;
}

TensorTrain matching(TensorTrain train, const Dims& dims) {
  if ((train.dims() == dims).all()) return train;
  std::ostringstream text;
  text << "compressed field: got a train of " << train.dims().transpose() << ", wanted " << dims.transpose();
  throw std::invalid_argument(text.str());
}

/// An eighth of the bound is for contracted columns, the rest for bricks.
struct CacheBytes {
  std::size_t columns, bricks;
};

CacheBytes cacheBytes(const TtFieldOptions& options) {
  if (!(options.cache_megabytes >= 0.0 && options.cache_megabytes <= 1e6)) {
    throw std::invalid_argument("compressed field: got a cache of " +
                                std::to_string(options.cache_megabytes) + " MB, wanted 0 to 1000000");
  }
  const auto eighth = static_cast<std::size_t>(0.125e6 * options.cache_megabytes);
  return {eighth, 7 * eighth};
}

}  // namespace

class TtDistanceField::Impl final : public GridField {
 public:
  Impl(TensorTrain train, const GridGeometry& geometry, SupportMask mask, const TtFieldOptions& options)
      : GridField(geometry, std::move(mask), options.interpolation, train.axes()),
        train_(matching(std::move(train), geometry.dims)),
        decoder_(train_, columnKernels(options.portable), ttsdf::cacheBytes(options).columns),
        bricks_(kBrickSamples,
                std::min(brickCount(), BlockCache::blocksWithin(ttsdf::cacheBytes(options).bricks,
                                                                kBrickSamples, brickCount())),
                brickCount()) {}

  const TensorTrain& train() const { return train_; }

  std::size_t memoryBytes() const override {
    const std::shared_lock<std::shared_mutex> lock(mutex_);
    return train_.memoryBytes() + decoder_.memoryBytes() + bricks_.memoryBytes() +
           GridField::mask().memoryBytes();
  }

  std::size_t cacheBytes() const {
    const std::shared_lock<std::shared_mutex> lock(mutex_);
    return decoder_.cacheBytes() + bricks_.memoryBytes();
  }

  void warmUp() const override {
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    const float h = static_cast<float>(geometry().voxel_size);
    bricks_.clear();  // whoever passed through the whole map has left the cache full of far places
    // Some corner of every cell that holds the surface is nearer than half a voxel. Then what scans pass
    // through on their way to it, the nearest first.
    std::vector<float> distances(brickCount());
    warmUp(distances, -1.0f, 0.5f * h);
    std::vector<float> sorted = distances;
    const std::size_t last = std::min(bricks_.capacity(), sorted.size()) - 1;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(last), sorted.end());
    warmUp(distances, 0.5f * h, std::min(sorted[last], kWarmVoxels * h));
  }

 protected:
  void corners(const CellChunk& cells, CornerChunk& out) const override {
    BrickChunk where;
    locateBricks(cells, decoder_.bricks()[0], decoder_.bricks()[1], where);
    {
      const std::shared_lock<std::shared_mutex> lock(mutex_);
      if (readCorners(where, cells.size, out)) return;
    }
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    for (int p = 0; p < cells.size; ++p) copyCorners(obtain(where.brick[p]) + where.offset[p], out.value[p]);
  }

  void stencils(const CellChunk& cells, StencilChunk& out) const override {
    const auto& sizes = chainSizes();
    withBricks([&](const auto& brick) {
      for (int p = 0; p < cells.size; ++p) {
        std::array<int, 3> index{{cells.cell[0][p], cells.cell[1][p], cells.cell[2][p]}};
        if (!sample(brick, index, out.value[p][0])) return false;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const int centre = index[axis];
          const DifferenceStencil d = differenceStencil(centre, sizes[axis]);
          float sum = 0.0f;
          for (int t = 0; t < 3; ++t) {
            if (d.weight[t] == 0.0f) continue;
            float value = 0.0f;
            index[axis] = d.index[t];
            if (!sample(brick, index, value)) return false;
            sum += d.weight[t] * value;
          }
          index[axis] = centre;
          out.value[p][axis + 1] = sum;
        }
      }
      return true;
    });
  }

 private:
  std::size_t brickCount() const {
    const auto& n = decoder_.bricks();
    return static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]);
  }
  BlockCache::Id idOf(int a, int b, int c) const {
    const auto& n = decoder_.bricks();
    return static_cast<BlockCache::Id>(a + n[0] * (b + n[1] * c));
  }

  /// Makes the bricks whose distance to the surface is above `from` and at most `to`, as far as there is
  /// room. With a negative `from` all are decoded and their distances noted.
  void warmUp(std::vector<float>& distances, float from, float to) const {
    const auto& n = decoder_.bricks();
    float samples[kBrickSamples];
    // The last mode runs fastest: it needs the same columns.
    for (int b = 0; b < n[1]; ++b) {
      for (int a = 0; a < n[0]; ++a) {
        for (int c = 0; c < n[2]; ++c) {
          const auto id = idOf(a, b, c);
          if (from >= 0.0f && bricks_.size() == bricks_.capacity()) return;
          if (from >= 0.0f && (distances[id] <= from || distances[id] > to)) continue;
          decoder_.decode(a, b, c, samples);
          if (from < 0.0f) {
            distances[id] = std::abs(samples[0]);
            for (const float sample : samples) distances[id] = std::min(distances[id], std::abs(sample));
          }
          if (distances[id] > to || bricks_.size() == bricks_.capacity()) continue;
          std::copy(samples, samples + kBrickSamples, bricks_.insert(id));
        }
      }
    }
  }

  static void copyCorners(const float* s, float* value) {
    std::memcpy(value, s, 2 * sizeof(float));
    std::memcpy(value + 2, s + kBrickSide, 2 * sizeof(float));
    std::memcpy(value + 4, s + kLayer, 2 * sizeof(float));
    std::memcpy(value + 6, s + kLayer + kBrickSide, 2 * sizeof(float));
  }

  /// False if a brick is missing.
  bool readCorners(const BrickChunk& where, int size, CornerChunk& out) const {
    alignas(64) std::uint32_t place[kChunk];
    if (!lookUp(bricks_.places(), where, size, place)) return false;
    const float* const data = bricks_.data();
    for (int p = 0; p < size; ++p) {
      copyCorners(data + std::size_t{place[p]} * kBrickSamples + where.offset[p], out.value[p]);
    }
    return true;
  }

  /// Reads one sample; false if its brick is not there.
  template <class Brick>
  bool sample(const Brick& brick, const std::array<int, 3>& index, float& value) const {
    std::array<int, 3> b;
    for (std::size_t mode = 0; mode < 3; ++mode) {
      b[mode] = std::min(index[mode] / kBrickCells, decoder_.bricks()[mode] - 1);
    }
    const float* const samples = brick(idOf(b[0], b[1], b[2]));
    if (!samples) return false;
    value = samples[index[0] - kBrickCells * b[0] + kBrickSide * (index[1] - kBrickCells * b[1]) +
                    kLayer * (index[2] - kBrickCells * b[2])];
    return true;
  }

  /// Runs `work(brick)` with a function from id to samples. Readers share the cache; where one misses a
  /// brick, `work` starts again alone and the bricks are made as it asks for them.
  template <class Work>
  void withBricks(const Work& work) const {
    {
      const std::shared_lock<std::shared_mutex> lock(mutex_);
      if (work([this](BlockCache::Id id) { return bricks_.find(id); })) return;
    }
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    work([this](BlockCache::Id id) { return obtain(id); });
  }

  /// The brick, made if need be. Caller holds the unique lock.
  const float* obtain(BlockCache::Id id) const {
    if (const float* const known = bricks_.find(id)) return known;
    float* const samples = bricks_.insert(id);
    const auto na = static_cast<BlockCache::Id>(decoder_.bricks()[0]),
               nb = static_cast<BlockCache::Id>(decoder_.bricks()[1]);
    decoder_.decode(static_cast<int>(id % na), static_cast<int>(id / na % nb), static_cast<int>(id / na / nb),
                    samples);
    return samples;
  }

  TensorTrain train_;
  mutable std::shared_mutex mutex_;
  mutable BrickDecoder decoder_;
  mutable BlockCache bricks_;
};

TtDistanceField::TtDistanceField(TensorTrain train, const GridGeometry& geometry, SupportMask mask,
                                 TtFieldOptions options)
    : impl_(std::make_unique<Impl>(std::move(train), geometry, std::move(mask), options)) {}
TtDistanceField::~TtDistanceField() = default;
const GridGeometry& TtDistanceField::geometry() const { return impl_->geometry(); }
void TtDistanceField::evaluate(const PointSpan& points, const SampleSpan& samples) const {
  impl_->evaluate(points, samples);
}
std::size_t TtDistanceField::memoryBytes() const { return impl_->memoryBytes(); }
const TensorTrain& TtDistanceField::train() const { return impl_->train(); }
const SupportMask& TtDistanceField::mask() const { return impl_->mask(); }
std::size_t TtDistanceField::cacheBytes() const { return impl_->cacheBytes(); }
void TtDistanceField::warmUp() const { impl_->warmUp(); }

}  // namespace ttsdf
