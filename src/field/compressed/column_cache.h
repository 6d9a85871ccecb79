#pragma once
// Contracted columns of stored cores, kept within a byte bound, the oldest out first. Registration asks again
// and again around the same surfaces: what one iteration contracts serves the next ones.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "../grid_locator.h"
#include "stored_cores.h"

namespace ttsdf {

/// Not thread-safe: the caller holds a lock. Takes no memory but that of its blocks, however large the map
/// is.
class ColumnCache {
 public:
  /// As many blocks as fit into `bytes`; at least kLeast, at most what the map has.
  ColumnCache(const StoredCores& cores, std::size_t bytes);
  static std::size_t bytesFor(const StoredCores& cores, std::size_t blocks);

  /// Corner samples of the given points of a chunk.
  void corners(const CellChunk& cells, const std::int32_t* points, int count, CornerChunk& out);
  /// Samples of side^3 grid points from (i, j, k) on, first mode fastest; behind the last sample of a mode it
  /// is repeated.
  void box(int i, int j, int k, int side, float* samples);
  float sample(int i, int j, int k);

  std::size_t memoryBytes() const;

  /// Blocks that are always there: a part of what one scan asks for.
  static constexpr std::size_t kLeast = 128;
  /// Blocks that a scan of a depth camera asks for, about: more are of little use to it.
  static constexpr std::size_t kScan = 1500;

 private:
  /// Columns [kColumnBlock a, ...) of slice j. Valid for the next three calls.
  ColumnBlock block(int a, int j);
  std::size_t bucketOf(std::uint64_t owner) const;
  void unlink(std::size_t place);
  std::size_t blockNumbers() const { return static_cast<std::size_t>(kColumnBlock * cores_->width()); }

  const StoredCores* cores_;
  std::vector<std::int16_t> numbers_;   // per block
  std::vector<float> scales_;           // per block
  std::vector<std::uint64_t> owners_;   // per block: id + 1, 0: free
  std::vector<std::uint32_t> buckets_;  // first block of a bucket + 1, 0: none
  std::vector<std::uint32_t> after_;    // per block: the next one of its bucket + 1
  std::size_t next_ = 0;                // the block that goes next
};

}  // namespace ttsdf
