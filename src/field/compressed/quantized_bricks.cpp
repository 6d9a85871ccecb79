#include "quantized_bricks.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "../../tensor/vectorize.h"

namespace ttsdf {

namespace {

constexpr int kLayer = kBrickSide * kBrickSide;
constexpr float kSteps = 255.0f;
constexpr float kLargest = std::numeric_limits<float>::max();

/// Half of the largest number leaves room for a difference of two.
inline float finite(float s) { return s < 0.5f * kLargest && s > -0.5f * kLargest ? s : 0.0f; }

int brickCount(int samples) { return std::max(1, (samples - 1 + kBrickCells - 1) / kBrickCells); }

/// Brick of every cell of a chunk, and the place of the cell's first corner in it.
struct BrickChunk {
  alignas(64) std::int32_t brick[3][kChunk];
  alignas(64) std::int32_t offset[kChunk];
};

TTSDF_VECTORIZE void locateBricks(const CellChunk& cells, BrickChunk& out) {
  for (int n = 0; n < cells.size; ++n) {
    const std::int32_t i = cells.cell[0][n], j = cells.cell[1][n], k = cells.cell[2][n];
    const std::int32_t a = i / kBrickCells, b = j / kBrickCells, c = k / kBrickCells;
    out.brick[0][n] = a, out.brick[1][n] = b, out.brick[2][n] = c;
    out.offset[n] = i - kBrickCells * a + kBrickSide * (j - kBrickCells * b) + kLayer * (k - kBrickCells * c);
  }
}

struct ByteChunk {
  alignas(64) std::uint8_t corner[kChunk][8];
  alignas(64) float lowest[kChunk], step[kChunk];
};

TTSDF_VECTORIZE void toFloats(const ByteChunk& bytes, int size, CornerChunk& out) {
  TTSDF_INDEPENDENT
  for (int n = 0; n < size; ++n) {
    const float lowest = bytes.lowest[n], step = bytes.step[n];
    for (int c = 0; c < 8; ++c) {
      out.value[n][c] = lowest + step * static_cast<float>(static_cast<std::int32_t>(bytes.corner[n][c]));
    }
  }
}

struct SampleRange {
  float lowest, highest;
};

TTSDF_VECTORIZE SampleRange rangeOf(const float* samples) {
  constexpr int kLanes = 16;
  float lowest[kLanes], highest[kLanes];
  for (int l = 0; l < kLanes; ++l) {
    lowest[l] = kLargest;
    highest[l] = -kLargest;
  }
  for (int n = 0; n < kBrickSamples; n += kLanes) {
    for (int l = 0; l < kLanes; ++l) {
      const float s = finite(samples[n + l]);
      lowest[l] = s < lowest[l] ? s : lowest[l];
      highest[l] = s > highest[l] ? s : highest[l];
    }
  }
  SampleRange all{lowest[0], highest[0]};
  for (int l = 1; l < kLanes; ++l) {
    all.lowest = lowest[l] < all.lowest ? lowest[l] : all.lowest;
    all.highest = highest[l] > all.highest ? highest[l] : all.highest;
  }
  return all;
}

/// Nearest steps above `lowest`.
TTSDF_VECTORIZE void quantizeSamples(const float* samples, float lowest, float per_step, std::uint8_t* out) {
  for (int n = 0; n < kBrickSamples; ++n) {
    const float steps = (finite(samples[n]) - lowest) * per_step + 0.5f;
    out[n] = static_cast<std::uint8_t>(static_cast<std::int32_t>(steps < kSteps ? steps : kSteps));
  }
}

void copyCorners(const std::uint8_t* s, std::uint8_t* corner) {
  std::memcpy(corner, s, 2);
  std::memcpy(corner + 2, s + kBrickSide, 2);
  std::memcpy(corner + 4, s + kLayer, 2);
  std::memcpy(corner + 6, s + kLayer + kBrickSide, 2);
}

}  // namespace

std::array<int, 3> QuantizedBricks::countsFor(const std::array<int, 3>& sizes) {
  return {{brickCount(sizes[0]), brickCount(sizes[1]), brickCount(sizes[2])}};
}

std::size_t QuantizedBricks::bytesFor(const std::array<int, 3>& sizes, std::size_t count) {
  std::size_t ids = 1;
  for (const int n : countsFor(sizes)) ids *= static_cast<std::size_t>(n);
  const std::size_t words = (ids + 63) / 64;
  return words * (sizeof(std::uint64_t) + sizeof(std::uint32_t)) + count * (kBrickSamples + sizeof(Range));
}

QuantizedBricks::QuantizedBricks(const std::array<int, 3>& sizes) : counts_(countsFor(sizes)) {
  bits_.assign((idCount() + 63) / 64, 0);
  before_.assign(bits_.size(), 0);
}

std::size_t QuantizedBricks::largestWhole(std::size_t bytes) {
  return bytes / (kBrickSamples + sizeof(Range));
}

std::size_t QuantizedBricks::fitting(std::size_t count, std::size_t bytes) {
  constexpr std::size_t kBrick = kBrickSamples + sizeof(Range);
  if (count * kBrick <= bytes) return count;
  const std::size_t table = count * sizeof(std::uint32_t);
  return bytes > table ? (bytes - table) / (kBrick + sizeof(std::uint32_t) + sizeof(std::uint8_t)) : 0;
}

std::size_t QuantizedBricks::reserved() const {
  std::size_t count = 0;
  for (const std::uint64_t word : bits_) count += bitCount(word);
  return count;
}

void QuantizedBricks::allocate() { allocate(std::numeric_limits<std::size_t>::max()); }

/// Which bricks there are is known: from now on their places are.
std::uint32_t QuantizedBricks::countBits() {
  std::uint32_t count = 0;
  for (std::size_t word = 0; word < bits_.size(); ++word) {
    before_[word] = count;
    count += bitCount(bits_[word]);
  }
  return count;
}

void QuantizedBricks::allocate(std::size_t most) {
  const std::uint32_t count = countBits();
  const std::size_t held = std::min<std::size_t>(most, count);
  ranges_.assign(held, Range{0.0f, 0.0f});
  bytes_.assign(held * kBrickSamples, 0);
  if (held == count) return;
  slots_.assign(count, 0);
  owners_.assign(held, 0);
  used_.assign(held, 0);
}

void QuantizedBricks::append(Id id, const float* samples) {
  reserve(id);
  ranges_.emplace_back();
  bytes_.resize(bytes_.size() + kBrickSamples);
  toBytes(ranges_.size() - 1, samples);
}

void QuantizedBricks::dropAppended() {
  // Assigning {} would keep their memory.
  ranges_ = decltype(ranges_)();
  bytes_ = decltype(bytes_)();
}

void QuantizedBricks::finish() {
  countBits();
  ranges_.shrink_to_fit();
  bytes_.shrink_to_fit();
}

void QuantizedBricks::toBytes(std::size_t slot, const float* samples) {
  const SampleRange range = rangeOf(samples);
  const float step = (range.highest - range.lowest) / kSteps;
  ranges_[slot] = Range{range.lowest, step};
  quantizeSamples(samples, range.lowest, step > 0.0f ? 1.0f / step : 0.0f, &bytes_[slot * kBrickSamples]);
}

void QuantizedBricks::set(Id id, const float* samples) { toBytes(placeOf(id), samples); }

/// Of the brick that was not used for the longest time, about ("clock" replacement).
std::size_t QuantizedBricks::freeSlot() {
  while (used_[hand_] != 0) {
    used_[hand_] = 0;
    hand_ = (hand_ + 1) % used_.size();
  }
  const std::size_t slot = hand_;
  hand_ = (hand_ + 1) % used_.size();
  if (owners_[slot] != 0) slots_[owners_[slot] - 1] = 0;
  return slot;
}

template <class SlotOf>
int QuantizedBricks::copy(const CellChunk& cells, CornerChunk& out, std::int32_t* missing,
                          const SlotOf& slotOf) const {
  BrickChunk where;
  ByteChunk bytes;
  locateBricks(cells, where);
  int misses = 0;
  const bool none = bytes_.empty();
  for (int n = 0; n < cells.size; ++n) {
    const int a = where.brick[0][n], b = where.brick[1][n], c = where.brick[2][n];
    const Id id = idOf(a, b, c);
    if (none || !has(id)) {
      missing[misses++] = n;
      bytes.lowest[n] = bytes.step[n] = 0.0f;
      std::memset(bytes.corner[n], 0, 8);
      continue;
    }
    const std::size_t slot = slotOf(placeOf(id), a, b, c);
    bytes.lowest[n] = ranges_[slot].lowest;
    bytes.step[n] = ranges_[slot].step;
    copyCorners(&bytes_[slot * kBrickSamples + static_cast<std::size_t>(where.offset[n])], bytes.corner[n]);
  }
  toFloats(bytes, cells.size, out);
  return misses;
}

int QuantizedBricks::corners(const CellChunk& cells, CornerChunk& out, std::int32_t* missing) const {
  return copy(cells, out, missing, [](std::size_t place, int, int, int) { return place; });
}

void QuantizedBricks::makeOne(std::size_t place, int a, int b, int c, const Decode& decode) {
  std::array<float, kBrickSamples> samples;
  decode(a, b, c, samples.data());
  const std::size_t slot = freeSlot();
  toBytes(slot, samples.data());
  owners_[slot] = static_cast<std::uint32_t>(place + 1);
  slots_[place] = static_cast<std::uint32_t>(slot + 1);
  used_[slot] = 1;
}

void QuantizedBricks::findUnmade(const CellChunk& cells, std::vector<Id>& ids) {
  BrickChunk where;
  locateBricks(cells, where);
  Id last = idCount();
  for (int n = 0; n < cells.size; ++n) {
    const Id id = idOf(where.brick[0][n], where.brick[1][n], where.brick[2][n]);
    if (id == last || !has(id)) continue;
    last = id;
    const std::uint32_t slot = slots_[placeOf(id)];
    if (slot == 0) {
      ids.push_back(id);
    } else {
      used_[slot - 1] = 1;  // not to go for those made now
    }
  }
}

void QuantizedBricks::make(std::vector<Id>& ids, const Decode& decode) {
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  if (ids.size() > size()) ids.resize(size());
  const Id rows = static_cast<Id>(counts_[2]), layers = rows * static_cast<Id>(counts_[0]);
  for (const Id id : ids) {
    makeOne(placeOf(id), static_cast<int>(id / rows % static_cast<Id>(counts_[0])),
            static_cast<int>(id / layers), static_cast<int>(id % rows), decode);
  }
}

int QuantizedBricks::corners(const CellChunk& cells, CornerChunk& out, std::int32_t* missing,
                             const Decode& decode) {
  return copy(cells, out, missing, [&](std::size_t place, int a, int b, int c) {
    if (slots_[place] == 0) makeOne(place, a, b, c, decode);
    const std::size_t slot = slots_[place] - 1;
    used_[slot] = 1;
    return slot;
  });
}

std::size_t QuantizedBricks::memoryBytes() const {
  return bits_.capacity() * sizeof(std::uint64_t) + before_.capacity() * sizeof(std::uint32_t) +
         ranges_.capacity() * sizeof(Range) + bytes_.capacity() +
         (slots_.capacity() + owners_.capacity()) * sizeof(std::uint32_t) + used_.capacity();
}

}  // namespace ttsdf
