#pragma once
// A bounded cache of equally large blocks of floats, oldest out first. Blocks lie in memory in the order of
// their arrival, so what is asked for together stays together. A table has a place for every id: finding a
// block is one look, whether it is there or not.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace ttsdf {

/// Many readers or one writer: the caller holds the lock.
class BlockCache {
 public:
  using Id = std::uint32_t;

  /// Blocks of `block_floats` floats that fit into `bytes` beside a table of `ids` places; at least 1.
  static std::size_t blocksWithin(std::size_t bytes, std::size_t block_floats, std::size_t ids);

  /// At most `max_blocks` (>= 1) blocks of `block_floats` floats with ids below `ids`; 64-byte aligned if
  /// block_floats is a multiple of 16.
  BlockCache(std::size_t block_floats, std::size_t max_blocks, std::size_t ids);

  /// The block, or null. Valid until `capacity()` further insertions.
  const float* find(Id id) const { return places_[id] ? block(places_[id] - 1) : nullptr; }
  /// Room for a block that find does not know; the caller fills it. Drops the oldest block when full.
  float* insert(Id id);
  void clear();

  /// For every id 0, or 1 plus the block's number: it starts at data()[number * blockFloats()].
  const std::uint32_t* places() const { return places_.data(); }
  const float* data() const { return memory_.get(); }

  std::size_t capacity() const { return owners_.size(); }
  std::size_t size() const { return used_; }
  std::size_t blockFloats() const { return block_floats_; }
  /// Blocks and table [bytes].
  std::size_t memoryBytes() const;

 private:
  struct Free {
    void operator()(float* memory) const;
  };

  float* block(std::uint32_t number) const { return memory_.get() + number * block_floats_; }

  std::size_t block_floats_;
  std::unique_ptr<float[], Free> memory_;  // untouched, so not resident, until used
  std::vector<Id> owners_;                 // per block
  std::vector<std::uint32_t> places_;      // per id
  std::size_t used_ = 0, next_ = 0;
};

}  // namespace ttsdf
