#include "brick_decoder.h"

#include <algorithm>

namespace ttsdf {

static_assert(kBrickSide % kColumnBlock == 0 && kColumnBlock == 4 && kBrickSide % 2 == 0,
              "the kernels contract four columns together and take dot products with two rows");

namespace {

int padded(int n) { return (n + kColumnPad - 1) / kColumnPad * kColumnPad; }

int brickCount(int samples) { return std::max(1, (samples - 1 + kBrickCells - 1) / kBrickCells); }

/// Samples that the bricks of a mode span.
int span(int bricks) { return bricks * kBrickCells + 1; }

std::size_t product(int a, int b) { return static_cast<std::size_t>(a) * static_cast<std::size_t>(b); }

}  // namespace

BrickDecoder::BrickDecoder(const TensorTrain& train, const ColumnKernels& kernels, std::size_t cache_bytes)
    : kernels_(kernels),
      bricks_{{brickCount(train.modeSizes()[0]), brickCount(train.modeSizes()[1]),
               brickCount(train.modeSizes()[2])}},
      middle_size_(train.modeSizes()[1]),
      rank1_(train.rank1()),
      width_(padded(train.rank2())),
      columns_(product(kBrickSide, width_),
               std::min(product(bricks_[0], middle_size_),
                        BlockCache::blocksWithin(cache_bytes, product(kBrickSide, width_),
                                                 product(bricks_[0], middle_size_))),
               product(bricks_[0], middle_size_)) {
  layOutFirst(train);
  layOutMiddle(train);
  layOutLast(train);
}

void BrickDecoder::layOutFirst(const TensorTrain& train) {
  const int rows = span(bricks_[0]), n = train.modeSizes()[0];
  first_.resize(product(rows, rank1_));
  for (int i = 0; i < rows; ++i) {
    for (int a = 0; a < rank1_; ++a)
      first_[product(i, rank1_) + static_cast<std::size_t>(a)] = train.first()(std::min(i, n - 1), a);
  }
}

void BrickDecoder::layOutMiddle(const TensorTrain& train) {
  const int r2 = train.rank2();
  middle_.assign(product(middle_size_, rank1_) * static_cast<std::size_t>(width_), 0.0f);
  for (int j = 0; j < middle_size_; ++j) {
    for (int a = 0; a < rank1_; ++a) {
      float* const row =
          &middle_[(product(j, rank1_) + static_cast<std::size_t>(a)) * static_cast<std::size_t>(width_)];
      for (int b = 0; b < r2; ++b) row[b] = train.slice(j)(a, b);
    }
  }
}

void BrickDecoder::layOutLast(const TensorTrain& train) {
  const int rows = span(bricks_[2]), n = train.modeSizes()[2], r2 = train.rank2();
  last_.assign(product(rows, width_), 0.0f);
  for (int k = 0; k < rows; ++k) {
    for (int b = 0; b < r2; ++b)
      last_[product(k, width_) + static_cast<std::size_t>(b)] = train.last()(b, std::min(k, n - 1));
  }
}

const float* BrickDecoder::columns(int a, int j) {
  const auto id = static_cast<BlockCache::Id>(product(j, bricks_[0]) + static_cast<std::size_t>(a));
  if (const float* const known = columns_.find(id)) return known;
  float* const block = columns_.insert(id);
  for (int q = 0; q < kBrickSide; q += kColumnBlock) {
    kernels_.contract(&first_[product(a * kBrickCells + q, rank1_)], rank1_,
                      &middle_[product(j, rank1_) * static_cast<std::size_t>(width_)], rank1_, width_,
                      block + q * width_);
  }
  return block;
}

void BrickDecoder::decode(int a, int b, int c, float* samples) {
  constexpr int kLayer = kBrickSide * kBrickSide;
  for (int dj = 0; dj < kBrickSide; ++dj) {
    const float* const block = columns(a, std::min(b * kBrickCells + dj, middle_size_ - 1));
    for (int di = 0; di < kBrickSide; di += kColumnBlock) {
      const float* const first = block + di * width_;
      const float* const four[4] = {first, first + width_, first + 2 * width_, first + 3 * width_};
      for (int dk = 0; dk < kBrickSide; dk += 2) {
        const float* const row = &last_[product(c * kBrickCells + dk, width_)];
        const float* const two[2] = {row, row + width_};
        float dots[8];
        kernels_.dots(four, two, width_, dots);
        float* const out = samples + dk * kLayer + dj * kBrickSide + di;
        std::copy(dots, dots + 4, out);
        std::copy(dots + 4, dots + 8, out + kLayer);
      }
    }
  }
}

std::size_t BrickDecoder::memoryBytes() const {
  return (first_.size() + middle_.size() + last_.size()) * sizeof(float) + cacheBytes();
}

}  // namespace ttsdf
