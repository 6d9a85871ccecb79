#pragma once
// A bounded cache of equally large blocks of floats, oldest out first. Blocks lie in memory in the order of
// their arrival, so what is asked for together stays together.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace ttsdf {

/// Many readers or one writer: the caller holds the lock.
class BlockCache {
 public:
  using Id = std::uint32_t;  ///< below 2^32 - 1

  /// Blocks of `block_floats` floats that fit into `bytes`, book-keeping included; at least 1.
  static std::size_t blocksWithin(std::size_t bytes, std::size_t block_floats);

  /// At most `max_blocks` (>= 1) blocks of `block_floats` floats, 64-byte aligned if block_floats is a
  /// multiple of 16.
  BlockCache(std::size_t block_floats, std::size_t max_blocks);

  /// The block, or null. Valid until `capacity()` further insertions.
  const float* find(Id id) const {
    const Entry* const bucket = &directory_[bucketOf(id)];
    for (std::size_t n = 0; n < kWays; ++n) {
      if (bucket[n].id == id) return block(bucket[n].slot);
    }
    return nullptr;
  }
  /// Starts loading what find will look at.
  void prefetch(Id id) const { __builtin_prefetch(&directory_[bucketOf(id)]); }
  /// Room for a block that find does not know; the caller fills it. Drops the oldest block when full, and now
  /// and then another one (the directory is lossy: it never grows with the number of ids).
  float* insert(Id id);
  void clear();

  std::size_t capacity() const { return owners_.size(); }
  std::size_t size() const { return used_; }
  std::size_t blockBytes() const { return block_floats_ * sizeof(float); }
  /// Blocks and directory [bytes].
  std::size_t memoryBytes() const;

 private:
  struct Entry {
    Id id;
    std::uint32_t slot;
  };
  struct Free {
    void operator()(float* memory) const;
  };

  static constexpr std::size_t kWays = 4;  // entries of a bucket, newest first

  std::size_t bucketOf(Id id) const {  // Fibonacci hashing
    return kWays * static_cast<std::size_t>((id * std::uint32_t{2654435769u}) >> shift_);
  }
  float* block(std::uint32_t slot) const { return memory_.get() + slot * block_floats_; }
  void forget(Id id, std::uint32_t slot);

  std::size_t block_floats_;
  std::unique_ptr<float[], Free> memory_;  // untouched, so not resident, until used
  std::vector<Id> owners_;                 // per slot
  std::vector<Entry> directory_;
  int shift_ = 0;
  std::size_t used_ = 0, next_ = 0;
};

}  // namespace ttsdf
