#include "bit_model.h"

#include <algorithm>

namespace ttsdf {

namespace {

constexpr int kHalfRange = 2047;          // of logits, in 256ths
constexpr std::uint32_t kMostSeen = 127;  // bits after which a counter forgets
constexpr std::int32_t kRate = 50;        // of the mixing weights
constexpr std::int32_t kFirstWeight = (1 << 16) * 3 / 10;

/// A counter is a probability (22 bits) and how many bits it has seen (10 bits).
constexpr int kSeenBits = 10;
constexpr std::uint32_t kSeen = (1u << kSeenBits) - 1;
constexpr std::uint32_t kFirstCounter = 1u << 31;

/// What the next bit counts for among those seen, in 65536ths: the mean of all, until they are too many.
constexpr std::array<std::int32_t, kMostSeen + 1> kShares = [] {
  std::array<std::int32_t, kMostSeen + 1> shares{};
  for (std::uint32_t seen = 0; seen <= kMostSeen; ++seen)
    shares[seen] = static_cast<std::int32_t>(2 * 65536 / (2 * seen + 3));
  return shares;
}();

/// 4096 / (1 + exp(-x / 256)) by interpolation.
int squash(int x) {
  constexpr std::array<int, 33> kTable = {1,    2,    3,    6,    10,   16,   27,   45,   73,   120,  194,
                                          310,  488,  747,  1101, 1546, 2047, 2549, 2994, 3348, 3607, 3785,
                                          3901, 3975, 4022, 4050, 4068, 4079, 4085, 4089, 4092, 4093, 4094};
  if (x > kHalfRange) return 4095;
  if (x < -kHalfRange) return 1;
  const int weight = x & 127;
  const auto n = static_cast<std::size_t>((x >> 7) + 16);
  return (kTable[n] * (128 - weight) + kTable[n + 1] * weight + 64) >> 7;
}

/// The inverse of squash.
const std::array<std::int16_t, 4096>& stretchTable() {
  static const std::array<std::int16_t, 4096> kTable = [] {
    std::array<std::int16_t, 4096> table{};
    int next = 0;
    for (int x = -kHalfRange; x <= kHalfRange; ++x) {
      for (; next <= squash(x); ++next) table[static_cast<std::size_t>(next)] = static_cast<std::int16_t>(x);
    }
    for (; next < 4096; ++next) table[static_cast<std::size_t>(next)] = kHalfRange;
    return table;
  }();
  return kTable;
}

}  // namespace

BitModel::BitModel(std::size_t places, std::size_t sets)
    : places_per_context_(places),
      counters_(places * kContexts, kFirstCounter),
      weights_(sets * kContexts, kFirstWeight) {}

void BitModel::forget() {
  std::fill(counters_.begin(), counters_.end(), kFirstCounter);
  std::fill(weights_.begin(), weights_.end(), kFirstWeight);
}

int BitModel::predict(const std::array<std::uint32_t, kContexts>& places, std::size_t set) {
  const std::array<std::int16_t, 4096>& stretch = stretchTable();
  active_weights_ = &weights_[set * kContexts];
  std::int64_t sum = 0;
  for (std::size_t n = 0; n < kContexts; ++n) {
    active_[n] = &counters_[n * places_per_context_ + places[n]];
    inputs_[n] = stretch[*active_[n] >> (kSeenBits + 10)];
    sum += std::int64_t{active_weights_[n]} * inputs_[n];
  }
  mixed_ = squash(static_cast<int>(std::clamp<std::int64_t>(sum / 65536, -kHalfRange, kHalfRange)));
  return std::clamp(mixed_, 1, 4095);
}

void BitModel::learn(bool bit) {
  constexpr std::int32_t kOne = (1 << 22) - 1;
  const std::int32_t target = bit ? kOne : 0;
  const std::int32_t error = ((bit ? 4096 : 0) - mixed_) * kRate;
  for (std::size_t n = 0; n < kContexts; ++n) {
    active_weights_[n] += static_cast<std::int32_t>((std::int64_t{inputs_[n]} * error) / 65536);
    // The mean of what was seen, until it forgets.
    Counter& counter = *active_[n];
    const std::uint32_t seen = counter & kSeen;
    const std::int64_t step = std::int64_t{target} - (counter >> kSeenBits);
    const std::int64_t moved = step * kShares[seen] / 65536;
    counter = static_cast<Counter>(static_cast<std::int64_t>(counter >> kSeenBits) + moved) << kSeenBits |
              (seen < kMostSeen ? seen + 1 : seen);
  }
}

}  // namespace ttsdf
