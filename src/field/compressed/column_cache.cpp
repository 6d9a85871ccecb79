#include "column_cache.h"

#include <algorithm>

namespace ttsdf {

namespace {

constexpr std::size_t kInUse = 4;  // blocks that a caller holds at the same time

std::size_t blocksOf(const StoredCores& cores) {
  return static_cast<std::size_t>(cores.blocks()) * static_cast<std::size_t>(cores.sizes()[1]);
}

/// With its places in the table.
std::size_t blockBytes(const StoredCores& cores) {
  return kColumnBlock * (static_cast<std::size_t>(cores.width()) * sizeof(std::int16_t) + sizeof(float)) +
         sizeof(std::uint64_t) + 2 * sizeof(std::uint32_t);
}

}  // namespace

std::size_t ColumnCache::bytesFor(const StoredCores& cores, std::size_t blocks) {
  return std::max(std::min(blocks, blocksOf(cores)), 2 * kInUse) * blockBytes(cores);
}

ColumnCache::ColumnCache(const StoredCores& cores, std::size_t bytes) : cores_(&cores) {
  const std::size_t fitting = std::max(bytes / blockBytes(cores), kLeast);
  const std::size_t count = std::max(std::min(fitting, blocksOf(cores)), 2 * kInUse);
  numbers_.resize(count * blockNumbers());
  scales_.resize(count * kColumnBlock);
  owners_.assign(count, 0);
  after_.assign(count, 0);
  buckets_.assign(count, 0);
}

/// Fibonacci hashing; the upper half of the product is scaled to the number of buckets.
std::size_t ColumnCache::bucketOf(std::uint64_t owner) const {
  return static_cast<std::size_t>(((owner * 0x9E3779B97F4A7C15u) >> 32) * buckets_.size() >> 32);
}

void ColumnCache::unlink(std::size_t place) {
  std::uint32_t* link = &buckets_[bucketOf(owners_[place])];
  while (*link != place + 1) link = &after_[*link - 1];
  *link = after_[place];
}

ColumnBlock ColumnCache::block(int a, int j) {
  const std::uint64_t owner = static_cast<std::uint64_t>(j) * static_cast<std::uint64_t>(cores_->blocks()) +
                              static_cast<std::uint64_t>(a) + 1;
  std::uint32_t& bucket = buckets_[bucketOf(owner)];
  std::size_t found = bucket;
  while (found != 0 && owners_[found - 1] != owner) found = after_[found - 1];
  if (found == 0) {
    if (owners_[next_] != 0) unlink(next_);
    owners_[next_] = owner;
    after_[next_] = bucket;
    bucket = static_cast<std::uint32_t>(next_ + 1);
    cores_->contract(a, j, &scales_[next_ * kColumnBlock], &numbers_[next_ * blockNumbers()]);
    found = next_ + 1;
    next_ = found % owners_.size();
  } else if ((found - 1 < next_ ? owners_.size() : 0) + found - 1 - next_ < kInUse) {
    next_ = found % owners_.size();  // what is in use must not be the next to go
  }
  return {&scales_[(found - 1) * kColumnBlock], &numbers_[(found - 1) * blockNumbers()]};
}

void ColumnCache::corners(const CellChunk& cells, const std::int32_t* points, int count, CornerChunk& out) {
  const int width = cores_->width();
  const std::array<int, 3>& sizes = cores_->sizes();
  for (int n = 0; n < count; ++n) {
    const std::int32_t p = points[n];
    const int i0 = cells.cell[0][p], j0 = cells.cell[1][p], k0 = cells.cell[2][p];
    const int i1 = std::min(i0 + 1, sizes[0] - 1), j1 = std::min(j0 + 1, sizes[1] - 1),
              k1 = std::min(k0 + 1, sizes[2] - 1);
    const std::int16_t* columns[4];
    float scale[4];
    const int is[2] = {i0, i1}, js[2] = {j0, j1};
    for (int q = 0; q < 4; ++q) {
      const int i = is[q & 1];
      const ColumnBlock of = block(i / kColumnBlock, js[q >> 1]);
      columns[q] = of.numbers + (i % kColumnBlock) * width;
      scale[q] = of.scale[i % kColumnBlock];
    }
    const std::int16_t* const rows[2] = {cores_->last(k0), cores_->last(k1)};
    std::int32_t dots[2][4];
    dotProducts(columns, rows, width, dots);
    const float at_k[2] = {cores_->lastScale(k0), cores_->lastScale(k1)};
    for (int r = 0; r < 2; ++r) {
      for (int q = 0; q < 4; ++q)
        out.value[p][4 * r + q] = at_k[r] * scale[q] * static_cast<float>(dots[r][q]);
    }
  }
}

void ColumnCache::box(int i, int j, int k, int side, float* samples) {
  static thread_local std::vector<std::int32_t> storage;
  const int width = cores_->width();
  storage.resize(static_cast<std::size_t>(width / 2 * kRowsTogether));
  auto* const pairs = reinterpret_cast<std::int32_t(*)[kRowsTogether]>(storage.data());
  const std::array<int, 3>& sizes = cores_->sizes();
  for (int dk = 0; dk < side; dk += kRowsTogether) {
    float at_k[kRowsTogether];
    cores_->rowsTogether(k + dk, pairs, at_k);
    const int rows = std::min(kRowsTogether, side - dk);
    for (int dj = 0; dj < side; ++dj) {
      for (int di = 0; di < side; di += kColumnBlock) {
        const std::int16_t* columns[kColumnBlock];
        float scale[kColumnBlock];
        for (int q = 0; q < kColumnBlock; ++q) {
          const int at = std::min(i + di + q, sizes[0] - 1);
          const ColumnBlock of = block(at / kColumnBlock, std::min(j + dj, sizes[1] - 1));
          columns[q] = of.numbers + (at % kColumnBlock) * width;
          scale[q] = of.scale[at % kColumnBlock];
        }
        std::int32_t dots[kColumnBlock][kRowsTogether];
        dotProducts(columns, pairs, width, dots);
        float* const out = samples + (dk * side + dj) * side + di;
        for (int q = 0; q < kColumnBlock && di + q < side; ++q) {
          for (int r = 0; r < rows; ++r)
            out[r * side * side + q] = at_k[r] * scale[q] * static_cast<float>(dots[q][r]);
        }
      }
    }
  }
}

float ColumnCache::sample(int i, int j, int k) {
  const ColumnBlock of = block(i / kColumnBlock, j);
  const std::int16_t* const column = of.numbers + (i % kColumnBlock) * cores_->width();
  const std::int16_t* const columns[4] = {column, column, column, column};
  const std::int16_t* const rows[2] = {cores_->last(k), cores_->last(k)};
  std::int32_t dots[2][4];
  dotProducts(columns, rows, cores_->width(), dots);
  return cores_->lastScale(k) * of.scale[i % kColumnBlock] * static_cast<float>(dots[0][0]);
}

std::size_t ColumnCache::memoryBytes() const {
  return numbers_.size() * sizeof(std::int16_t) + scales_.size() * sizeof(float) +
         owners_.size() * sizeof(std::uint64_t) + (after_.size() + buckets_.size()) * sizeof(std::uint32_t);
}

}  // namespace ttsdf
