#include "block_cache.h"

#include <algorithm>
#include <cstdlib>
#include <new>

namespace ttsdf {

std::size_t BlockCache::blocksWithin(std::size_t bytes, std::size_t block_floats, std::size_t ids) {
  const std::size_t table = ids * sizeof(std::uint32_t);
  const std::size_t per_block = block_floats * sizeof(float) + sizeof(Id);
  return bytes > table ? std::max<std::size_t>(1, (bytes - table) / per_block) : 1;
}

void BlockCache::Free::operator()(float* memory) const { std::free(memory); }

BlockCache::BlockCache(std::size_t block_floats, std::size_t max_blocks, std::size_t ids)
    : block_floats_(block_floats) {
  constexpr std::size_t kAlignment = 64;
  const std::size_t blocks = std::max<std::size_t>(1, max_blocks);
  const std::size_t bytes =
      (blocks * block_floats * sizeof(float) + kAlignment - 1) / kAlignment * kAlignment;
  memory_.reset(static_cast<float*>(std::aligned_alloc(kAlignment, bytes)));
  if (!memory_) throw std::bad_alloc();
  owners_.assign(blocks, 0);
  places_.assign(ids, 0);
}

float* BlockCache::insert(Id id) {
  const auto number = static_cast<std::uint32_t>(next_);
  next_ = (next_ + 1) % owners_.size();
  if (used_ < owners_.size()) {
    ++used_;
  } else {
    places_[owners_[number]] = 0;
  }
  owners_[number] = id;
  places_[id] = number + 1;
  return block(number);
}

void BlockCache::clear() {
  std::fill(places_.begin(), places_.end(), 0u);
  used_ = next_ = 0;
}

std::size_t BlockCache::memoryBytes() const {
  return used_ * block_floats_ * sizeof(float) + owners_.size() * sizeof(Id) +
         places_.size() * sizeof(std::uint32_t);
}

}  // namespace ttsdf
