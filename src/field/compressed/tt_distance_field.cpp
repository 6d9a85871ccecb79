#include "ttsdf_localization/field/tt_distance_field.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <sstream>
#include <stdexcept>

#include "surface_bricks.h"
#include "ttsdf_localization/field/long_range_field.h"

namespace ttsdf {

namespace {

constexpr std::size_t kLeastBricks = 1000;  // whatever the bound: with fewer, a scan makes them all the time

const TensorTrain& matching(const TensorTrain& train, const Dims& dims) {
  if ((train.dims() == dims).all() && train.rank1() > 0) return train;
  std::ostringstream text;
  text << "compressed field: got a train of " << train.dims().transpose() << ", wanted " << dims.transpose();
  throw std::invalid_argument(text.str());
}

std::size_t memoryBound(const TtFieldOptions& options) {
  if (!(options.memory_megabytes >= 0.0 && options.memory_megabytes <= 1e6)) {
    throw std::invalid_argument("compressed field: got a memory of " +
                                std::to_string(options.memory_megabytes) + " MB, wanted 0 to 1000000");
  }
  return static_cast<std::size_t>(1e6 * options.memory_megabytes);
}

}  // namespace

class TtDistanceField::Impl {
 public:
  Impl(const TensorTrain& train, const GridGeometry& geometry, SupportMask mask,
       const TtFieldOptions& options)
      : grid(geometry, std::move(mask), options.interpolation, train.axes()),
        cores(matching(train, geometry.dims)),
        columns(cores, 0) {
    const std::size_t always = cores.memoryBytes() + grid.mask().memoryBytes() +
                               LongRangeField::bytesFor(geometry) +
                               QuantizedBricks::bytesFor(cores.sizes(), 0);
    const std::size_t bound = memoryBound(options);
    room = bound > always ? bound - always : 0;
    columns = ColumnCache(cores, room);
  }

  /// Which bricks there are does not depend on the memory, and so neither do the answers.
  void warmUp(const KeepGoing& keep_going) {
    if (ready.load(std::memory_order_acquire)) return;
    const std::lock_guard<std::mutex> lock(mutex);
    if (ready.load(std::memory_order_relaxed)) return;
    const SurfaceBricks surface(cores, grid.geometry(), grid.mask());
    ColumnCache scratch(cores, ColumnCache::bytesFor(cores, ColumnCache::kScan));
    // Bricks serve what is near the surface, columns the few points far from it and the making of bricks.
    const std::size_t least = ColumnCache::bytesFor(cores, ColumnCache::kLeast);
    const std::size_t bytes = room - std::min(room, least);
    const std::size_t most = std::max(QuantizedBricks::largestWhole(bytes), kLeastBricks);
    bricks = surface.find(scratch, most, keep_going);
    const std::size_t all = bricks.reserved();
    if (all > most) bricks.allocate(std::max(QuantizedBricks::fitting(all, bytes), kLeastBricks));
    columns = ColumnCache(cores, least);
    ready.store(true, std::memory_order_release);
  }

  /// Without `far`, or before the field is warm, everything is asked of bricks and cores.
  void evaluate(const PointSpan& points, const DistanceField* far, const SampleSpan& samples);

  QuantizedBricks::Decode decode() {
    return [this](int a, int b, int c, float* samples) {
      columns.box(a * kBrickCells, b * kBrickCells, c * kBrickCells, kBrickSide, samples);
    };
  }

  /// Bricks made all at once share their columns.
  void prepare(const PointSpan& points) {
    if (!ready.load(std::memory_order_acquire) || bricks.whole()) return;
    CellChunk cells;
    const std::lock_guard<std::mutex> lock(mutex);
    std::vector<QuantizedBricks::Id> unmade;
    for (int begin = 0; begin < points.size; begin += kChunk) {
      cells.size = std::min(kChunk, points.size - begin);
      grid.locate(points, begin, cells);
      bricks.findUnmade(cells, unmade);
    }
    bricks.make(unmade, decode());
  }

  /// Of the cells in bricks; how many others are inside the box, and which.
  int nearCorners(const CellChunk& cells, CornerChunk& out, std::int32_t* missing) {
    int count = 0;
    if (!ready.load(std::memory_order_acquire)) {
      count = cells.size;
      for (int n = 0; n < count; ++n) missing[n] = n;
    } else if (bricks.whole()) {
      count = bricks.corners(cells, out, missing);
    } else {
      const std::lock_guard<std::mutex> lock(mutex);
      count = bricks.corners(cells, out, missing, decode());
    }
    return static_cast<int>(
        std::remove_if(missing, missing + count,
                       [&](std::int32_t n) { return cells.state[n] == PointState::kOutside; }) -
        missing);
  }

  void farCorners(const CellChunk& cells, const std::int32_t* missing, int count, CornerChunk& out) {
    if (count == 0) return;
    const std::lock_guard<std::mutex> lock(mutex);
    columns.corners(cells, missing, count, out);
  }

  void stencils(const CellChunk& cells, StencilChunk& out) {
    const std::lock_guard<std::mutex> lock(mutex);
    for (int p = 0; p < cells.size; ++p) {
      std::array<int, 3> index{{cells.cell[0][p], cells.cell[1][p], cells.cell[2][p]}};
      out.value[p][0] = columns.sample(index[0], index[1], index[2]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const int centre = index[axis];
        const DifferenceStencil d = differenceStencil(centre, grid.sizes()[axis]);
        float sum = 0.0f;
        for (int t = 0; t < 3; ++t) {
          if (d.weight[t] == 0.0f) continue;
          index[axis] = d.index[t];
          sum += d.weight[t] * columns.sample(index[0], index[1], index[2]);
        }
        index[axis] = centre;
        out.value[p][axis + 1] = sum;
      }
    }
  }

  FieldMemory memory() {
    const std::lock_guard<std::mutex> lock(mutex);
    FieldMemory bytes;
    bytes.cores = cores.memoryBytes();
    bytes.mask = grid.mask().memoryBytes();
    bytes.columns = columns.memoryBytes();
    bytes.bricks = ready.load(std::memory_order_relaxed) ? bricks.memoryBytes() : 0;
    return bytes;
  }

  GridLocator grid;
  StoredCores cores;
  std::mutex mutex;  // of the columns, and of bricks that come and go
  ColumnCache columns;
  QuantizedBricks bricks;  // once `ready`, a whole set is only read
  std::atomic<bool> ready{false};
  std::size_t room = 0;  // for columns and bricks [bytes]
};

TtDistanceField::TtDistanceField(const TensorTrain& train, const GridGeometry& geometry, SupportMask mask,
                                 TtFieldOptions options)
    : impl_(std::make_unique<Impl>(train, geometry, std::move(mask), options)) {}
TtDistanceField::~TtDistanceField() = default;
const GridGeometry& TtDistanceField::geometry() const { return impl_->grid.geometry(); }
FieldMemory TtDistanceField::memory() const { return impl_->memory(); }
std::size_t TtDistanceField::memoryBytes() const { return memory().total(); }
const SupportMask& TtDistanceField::mask() const { return impl_->grid.mask(); }
int TtDistanceField::rank1() const { return impl_->cores.rank1(); }
int TtDistanceField::rank2() const { return impl_->cores.rank2(); }
std::array<int, 3> TtDistanceField::modeSizes() const { return impl_->cores.sizes(); }
void TtDistanceField::warmUp(const KeepGoing& keep_going) const { impl_->warmUp(keep_going); }
void TtDistanceField::prepare(const PointSpan& points) const { impl_->prepare(points); }

/// Slices outside, then rows: the innermost walk is along one column after the other.
std::array<int, 3> TtDistanceField::walkOrder() const {
  const ModeOrder& axes = impl_->cores.axes();
  return {{axes[1], axes[0], axes[2]}};
}

namespace {

/// Values and gradients of some points, from another field.
void copyFrom(const DistanceField& far, const PointSpan& points, const std::int32_t* which, int count,
              const SampleSpan& samples) {
  float x[kChunk], y[kChunk], z[kChunk], value[kChunk], gradient[3][kChunk];
  PointState state[kChunk];
  for (int n = 0; n < count; ++n)
    x[n] = points.x[which[n]], y[n] = points.y[which[n]], z[n] = points.z[which[n]];
  far.evaluate(PointSpan{x, y, z, count}, SampleSpan{value, gradient[0], gradient[1], gradient[2], state});
  for (int n = 0; n < count; ++n) {
    samples.value[which[n]] = value[n];
    samples.gradient_x[which[n]] = gradient[0][n];
    samples.gradient_y[which[n]] = gradient[1][n];
    samples.gradient_z[which[n]] = gradient[2][n];
  }
}

}  // namespace

void TtDistanceField::Impl::evaluate(const PointSpan& points, const DistanceField* far,
                                     const SampleSpan& samples) {
  const bool nearest = grid.interpolation() == Interpolation::kNearest;
  if (nearest || !ready.load(std::memory_order_acquire)) far = nullptr;
  CellChunk cells;
  CornerChunk corners;
  StencilChunk differences;
  std::int32_t missing[kChunk];
  for (int begin = 0; begin < points.size; begin += kChunk) {
    cells.size = std::min(kChunk, points.size - begin);
    grid.locate(points, begin, cells);
    if (nearest) {
      stencils(cells, differences);
      grid.copy(cells, differences, samples, begin);
      continue;
    }
    const int count = nearCorners(cells, corners, missing);
    if (!far) {
      farCorners(cells, missing, count, corners);
      grid.interpolate(cells, corners, samples, begin);
      continue;
    }
    for (int n = 0; n < count; ++n) std::fill_n(corners.value[missing[n]], 8, 0.0f);
    grid.interpolate(cells, corners, samples, begin);
    for (int n = 0; n < count; ++n) missing[n] += begin;
    copyFrom(*far, points, missing, count, samples);
  }
}

void TtDistanceField::evaluate(const PointSpan& points, const SampleSpan& samples) const {
  impl_->evaluate(points, nullptr, samples);
}

void TtDistanceField::evaluate(const PointSpan& points, const DistanceField& far,
                               const SampleSpan& samples) const {
  impl_->evaluate(points, &far, samples);
}

}  // namespace ttsdf
