#include "block_cache.h"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <new>

namespace ttsdf {

namespace {
constexpr BlockCache::Id kNobody = std::numeric_limits<BlockCache::Id>::max();
}  // namespace

std::size_t BlockCache::blocksWithin(std::size_t bytes, std::size_t block_floats) {
  const std::size_t per_block = block_floats * sizeof(float) + sizeof(Id) + 4 * sizeof(Entry);
  return std::max<std::size_t>(1, bytes / per_block);
}

void BlockCache::Free::operator()(float* memory) const { std::free(memory); }

BlockCache::BlockCache(std::size_t block_floats, std::size_t max_blocks) : block_floats_(block_floats) {
  constexpr std::size_t kAlignment = 64;
  const std::size_t blocks = std::max<std::size_t>(1, max_blocks);
  const std::size_t bytes = (blocks * blockBytes() + kAlignment - 1) / kAlignment * kAlignment;
  memory_.reset(static_cast<float*>(std::aligned_alloc(kAlignment, bytes)));
  if (!memory_) throw std::bad_alloc();
  owners_.assign(blocks, kNobody);
  // Twice to four times as many entries as blocks: hardly ever do more ids meet than a bucket holds.
  int bits = 1;
  while (kWays << bits < 2 * blocks) ++bits;
  directory_.assign(kWays << bits, Entry{kNobody, 0});
  shift_ = 32 - bits;
}

float* BlockCache::insert(Id id) {
  const auto slot = static_cast<std::uint32_t>(next_);
  next_ = (next_ + 1) % owners_.size();
  if (owners_[slot] == kNobody) {
    ++used_;
  } else {
    forget(owners_[slot], slot);
  }
  owners_[slot] = id;
  // The oldest entry of a full bucket gives way: its block cannot be found any more and ages out.
  Entry* const bucket = &directory_[bucketOf(id)];
  Entry* const gap =
      std::find_if(bucket, bucket + kWays - 1, [](const Entry& entry) { return entry.id == kNobody; });
  std::move_backward(bucket, gap, gap + 1);
  bucket[0] = {id, slot};
  return block(slot);
}

void BlockCache::clear() {
  std::fill(owners_.begin(), owners_.end(), kNobody);
  std::fill(directory_.begin(), directory_.end(), Entry{kNobody, 0});
  used_ = next_ = 0;
}

void BlockCache::forget(Id id, std::uint32_t slot) {
  Entry* const bucket = &directory_[bucketOf(id)];
  for (std::size_t n = 0; n < kWays; ++n) {
    if (bucket[n].id == id && bucket[n].slot == slot) bucket[n].id = kNobody;
  }
}

std::size_t BlockCache::memoryBytes() const {
  return used_ * blockBytes() + owners_.size() * sizeof(Id) + directory_.size() * sizeof(Entry);
}

}  // namespace ttsdf
