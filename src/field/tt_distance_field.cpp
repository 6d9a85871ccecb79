#include "ttsdf_localization/field/tt_distance_field.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <shared_mutex>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "column_kernels.h"
#include "grid_field.h"

namespace ttsdf {

namespace {
int padded(int n) { return (n + kColumnPad - 1) / kColumnPad * kColumnPad; }
}  // namespace

class TtDistanceField::Impl final : public GridField {
 public:
  Impl(TensorTrain train, const GridGeometry& geometry, SupportMask mask, const TtFieldOptions& options)
      : GridField(geometry, std::move(mask), options.interpolation, train.axes()),
        train_(std::move(train)),
        kernels_(columnKernels(options.portable)),
        width_(padded(train_.rank2())),
        blocks_((chainSizes()[0] + kColumnBlock - 1) / kColumnBlock) {
    if ((train_.dims() != geometry.dims).any()) {
      std::ostringstream text;
      text << "compressed field: got a train of " << train_.dims().transpose() << ", wanted "
           << geometry.dims.transpose();
      throw std::invalid_argument(text.str());
    }
    layOutCores();
    slots_.assign(static_cast<std::size_t>(blocks_) * static_cast<std::size_t>(chainSizes()[1]), nullptr);
    // One chunk must always fit, whatever the bound.
    const auto wanted = static_cast<std::size_t>(std::max(0.0, options.cache_megabytes) * 1e6) /
                        (blockFloats() * sizeof(float));
    capacity_ = std::min(slots_.size(), std::max<std::size_t>(wanted, 8 * kChunk));
  }

  const TensorTrain& train() const { return train_; }

  std::size_t memoryBytes() const override {
    return train_.memoryBytes() + (first_.size() + slices_.size() + last_.size()) * sizeof(float) +
           slots_.size() * sizeof(float*) + GridField::mask().memoryBytes() + cacheBytes();
  }

  std::size_t cacheBytes() const { return allocated_.load() * blockFloats() * sizeof(float); }

  void warmUp() {
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    for (std::size_t slot = 0; slot < slots_.size() && used_ < capacity_; ++slot) {
      if (!slots_[slot]) contract(slot);
    }
  }

 protected:
  void corners(const CellChunk& cells, CornerChunk& out) const override {
    withColumns(cells, 1, [&] {
      const auto& n = chainSizes();
      const int di = n[0] > 1 ? 1 : 0, dj = n[1] > 1 ? 1 : 0;
      const std::size_t dk = n[2] > 1 ? static_cast<std::size_t>(width_) : 0;
      for (int p = 0; p < cells.size; ++p) {
        const int i = cells.cell[0][p], j = cells.cell[1][p];
        const float* const columns[4] = {column(i, j), column(i + di, j), column(i, j + dj),
                                         column(i + di, j + dj)};
        const float* const l =
            last_.data() + static_cast<std::size_t>(cells.cell[2][p]) * static_cast<std::size_t>(width_);
        const float* const lasts[2] = {l, l + dk};
        kernels_.corners(columns, lasts, width_, out.value[p]);
      }
    });
  }

  void stencils(const CellChunk& cells, StencilChunk& out) const override {
    withColumns(cells, 2, [&] {
      const auto& n = chainSizes();
      for (int p = 0; p < cells.size; ++p) {
        const int i = cells.cell[0][p], j = cells.cell[1][p], k = cells.cell[2][p];
        out.value[p][0] = dot(i, j, k);
        const DifferenceStencil a = differenceStencil(i, n[0]), b = differenceStencil(j, n[1]),
                                c = differenceStencil(k, n[2]);
        float da = 0.0f, db = 0.0f, dc = 0.0f;
        for (int t = 0; t < 3; ++t) {
          if (a.weight[t] != 0.0f) da += a.weight[t] * dot(a.index[t], j, k);
          if (b.weight[t] != 0.0f) db += b.weight[t] * dot(i, b.index[t], k);
          if (c.weight[t] != 0.0f) dc += c.weight[t] * dot(i, j, c.index[t]);
        }
        out.value[p][1] = da, out.value[p][2] = db, out.value[p][3] = dc;
      }
    });
  }

 private:
  std::size_t blockFloats() const {
    return static_cast<std::size_t>(kColumnBlock) * static_cast<std::size_t>(width_);
  }

  /// Row-major, zero-padded copies of the cores in the layout the kernels want.
  void layOutCores() {
    const auto& n = chainSizes();
    const int r1 = train_.rank1(), r2 = train_.rank2();
    first_.assign(static_cast<std::size_t>(blocks_) * kColumnBlock * static_cast<std::size_t>(r1), 0.0f);
    for (int i = 0; i < n[0]; ++i) {
      for (int a = 0; a < r1; ++a)
        first_[static_cast<std::size_t>(i) * r1 + static_cast<std::size_t>(a)] = train_.first()(i, a);
    }
    slices_.assign(
        static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(r1) * static_cast<std::size_t>(width_),
        0.0f);
    for (int j = 0; j < n[1]; ++j) {
      for (int a = 0; a < r1; ++a) {
        float* const row = &slices_[(static_cast<std::size_t>(j) * r1 + static_cast<std::size_t>(a)) *
                                    static_cast<std::size_t>(width_)];
        for (int b = 0; b < r2; ++b) row[b] = train_.slice(j)(a, b);
      }
    }
    last_.assign(static_cast<std::size_t>(n[2]) * static_cast<std::size_t>(width_), 0.0f);
    for (int k = 0; k < n[2]; ++k) {
      for (int b = 0; b < r2; ++b)
        last_[static_cast<std::size_t>(k) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(b)] =
            train_.last()(b, k);
    }
  }

  std::size_t slot(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(blocks_) +
           static_cast<std::size_t>(i / kColumnBlock);
  }
  const float* column(int i, int j) const { return slots_[slot(i, j)] + (i % kColumnBlock) * width_; }
  float dot(int i, int j, int k) const {
    const float* const c = column(i, j);
    const float* const l = last_.data() + static_cast<std::size_t>(k) * static_cast<std::size_t>(width_);
    float sum = 0.0f;
    for (int b = 0; b < width_; ++b) sum += c[b] * l[b];
    return sum;
  }

  /// Calls visit(slot) for every block of columns the chunk touches; `reach` 1: cell corners, 2: difference
  /// stencils.
  template <class Visitor>
  void touched(const CellChunk& cells, int reach, const Visitor& visit) const {
    const auto& n = chainSizes();
    for (int p = 0; p < cells.size; ++p) {
      const int i = cells.cell[0][p], j = cells.cell[1][p];
      if (reach == 1) {
        const int i1 = std::min(i + 1, n[0] - 1), j1 = std::min(j + 1, n[1] - 1);
        visit(slot(i, j)), visit(slot(i1, j)), visit(slot(i, j1)), visit(slot(i1, j1));
        continue;
      }
      const DifferenceStencil a = differenceStencil(i, n[0]), b = differenceStencil(j, n[1]);
      visit(slot(i, j));
      for (int t = 0; t < 3; ++t) visit(slot(a.index[t], j)), visit(slot(i, b.index[t]));
    }
  }

  /// Runs `work` with every column of the chunk in place. Readers share the cache; only a chunk that misses
  /// waits.
  template <class Work>
  void withColumns(const CellChunk& cells, int reach, const Work& work) const {
    {
      const std::shared_lock<std::shared_mutex> lock(mutex_);
      bool complete = true;
      touched(cells, reach, [&](std::size_t s) { complete &= slots_[s] != nullptr; });
      if (complete) {
        work();
        return;
      }
    }
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    std::size_t missing = 0;
    touched(cells, reach,
            [&](std::size_t s) { missing += slots_[s] ? 0 : 1; });  // counts repeats: an upper bound
    if (used_ + missing > capacity_) {
      std::fill(slots_.begin(), slots_.end(), nullptr);
      used_ = 0;
    }
    touched(cells, reach, [&](std::size_t s) {
      if (!slots_[s]) contract(s);
    });
    work();
  }

  /// Contracts the block of columns of a slot. Caller holds the unique lock.
  void contract(std::size_t s) const {
    const std::size_t j = s / static_cast<std::size_t>(blocks_),
                      block = s % static_cast<std::size_t>(blocks_);
    const int r1 = train_.rank1();
    float* const target = blockMemory(used_++);
    kernels_.contract(&first_[block * kColumnBlock * static_cast<std::size_t>(r1)], r1,
                      &slices_[j * static_cast<std::size_t>(r1) * static_cast<std::size_t>(width_)], r1,
                      width_, target);
    slots_[s] = target;
  }

  /// Memory of the n-th block; pages of many blocks are allocated as the cache grows.
  float* blockMemory(std::size_t n) const {
    constexpr std::size_t kPage = 512;
    if (n / kPage >= pages_.size()) {
      pages_.emplace_back(kPage * blockFloats() + 16);
      allocated_ += kPage;
    }
    auto& page = pages_[n / kPage];
    void* start = page.data();
    std::size_t space = page.size() * sizeof(float);
    std::align(64, kPage * blockFloats() * sizeof(float), start, space);
    return static_cast<float*>(start) + (n % kPage) * blockFloats();
  }

  TensorTrain train_;
  const ColumnKernels& kernels_;
  int width_;   // floats of a padded column
  int blocks_;  // blocks of kColumnBlock first indices
  std::vector<float> first_, slices_, last_;
  std::size_t capacity_ = 0;  // blocks

  mutable std::shared_mutex mutex_;
  mutable std::vector<float*> slots_;  // per (middle index, block): its columns or null
  mutable std::size_t used_ = 0;       // blocks in use
  mutable std::atomic<std::size_t> allocated_{0};
  mutable std::vector<std::vector<float>> pages_;
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
void TtDistanceField::warmUp() { impl_->warmUp(); }

}  // namespace ttsdf
