#pragma once
// Samples of a grid in bricks of 8 x 8 x 8, one byte each, of those parts only where somebody asks for them.
//
// A brick holds the corners of 7 x 7 x 7 cells and has a range of its own: its bytes are steps of a 255th of
// it. Distances change by one voxel per voxel at most, so a step is a twentieth of a voxel. Which bricks
// there are is one bit each; where they lie follows from how many bits are set before. Where there is no
// room for all of them, those asked for last are held, and the others are made again when they are asked for.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "../grid_locator.h"

namespace ttsdf {

constexpr int kBrickCells = 7;               ///< cells along an edge
constexpr int kBrickSide = kBrickCells + 1;  ///< samples along an edge
constexpr int kBrickSamples = kBrickSide * kBrickSide * kBrickSide;

/// A whole set, once filled, is only read, from any number of threads.
class QuantizedBricks {
 public:
  using Id = std::size_t;
  /// Writes the samples of a brick (its place along each axis), first axis fastest.
  using Decode = std::function<void(int a, int b, int c, float* samples)>;

  QuantizedBricks() = default;
  /// Bricks that cover a grid of `sizes` samples; none of them is there.
  explicit QuantizedBricks(const std::array<int, 3>& sizes);

  /// Bricks along each axis.
  const std::array<int, 3>& counts() const { return counts_; }
  /// In the order of ids, bricks of a compressed field need the same columns one after the other: the third
  /// place runs fastest, then the first.
  Id idOf(int a, int b, int c) const {
    return static_cast<Id>(c) + static_cast<Id>(counts_[2]) *
                                    (static_cast<Id>(a) + static_cast<Id>(counts_[0]) * static_cast<Id>(b));
  }
  std::size_t idCount() const {
    return static_cast<std::size_t>(counts_[0]) * static_cast<std::size_t>(counts_[1]) *
           static_cast<std::size_t>(counts_[2]);
  }

  /// Says that a brick will be there; all of them before the first `set`.
  void reserve(Id id) { bits_[id >> 6] |= std::uint64_t{1} << (id & 63); }
  /// Counts and makes room for all bricks, or for the `most` asked for last. Afterwards the set is fixed.
  void allocate();
  void allocate(std::size_t most);
  /// Room for all of them: nothing is ever made again.
  bool whole() const { return slots_.empty(); }
  std::size_t reserved() const;
  bool has(Id id) const { return (bits_[id >> 6] >> (id & 63)) & 1u; }
  std::size_t size() const { return ranges_.size(); }
  /// Of a whole set: samples, first axis fastest; not finite ones count as 0.
  void set(Id id, const float* samples);
  /// In place of reserve, allocate and set, brick by brick in the order of ids; `finish` fixes the set.
  void append(Id id, const float* samples);
  void finish();
  /// Keeps which bricks were appended, as if they had been reserved, and not their samples.
  void dropAppended();

  /// Corners of the cells of a chunk. Points whose brick is missing are noted in `missing` (their corners are
  /// left as they are); how many there are.
  int corners(const CellChunk& cells, CornerChunk& out, std::int32_t* missing) const;
  /// The same of a set that is not whole, by one thread at a time.
  int corners(const CellChunk& cells, CornerChunk& out, std::int32_t* missing, const Decode& decode);
  /// Of a set that is not whole: adds the bricks that these cells would have to make, some of them twice.
  void findUnmade(const CellChunk& cells, std::vector<Id>& ids);
  /// Makes bricks that are not there, in the order of ids and as many as there is room for.
  void make(std::vector<Id>& ids, const Decode& decode);

  /// Bytes held.
  std::size_t memoryBytes() const;
  /// Of `count` bricks in a grid of `sizes` samples.
  static std::size_t bytesFor(const std::array<int, 3>& sizes, std::size_t count);
  /// How many of `count` bricks `bytes` hold, beside what there always is.
  static std::size_t fitting(std::size_t count, std::size_t bytes);
  /// The largest set that `bytes` hold as a whole.
  static std::size_t largestWhole(std::size_t bytes);
  static std::array<int, 3> countsFor(const std::array<int, 3>& sizes);

 private:
  struct Range {
    float lowest, step;
  };
  /// Among the bricks of the set.
  std::size_t placeOf(Id id) const {
    const std::uint64_t below = bits_[id >> 6] & ((std::uint64_t{1} << (id & 63)) - 1);
    return before_[id >> 6] + bitCount(below);
  }
  /// Inline: without -mpopcnt the compiler's own is a call.
  static std::uint32_t bitCount(std::uint64_t bits) {
    bits -= (bits >> 1) & 0x5555555555555555U;
    bits = (bits & 0x3333333333333333U) + ((bits >> 2) & 0x3333333333333333U);
    bits = (bits + (bits >> 4)) & 0x0f0f0f0f0f0f0f0fU;
    return static_cast<std::uint32_t>((bits * 0x0101010101010101U) >> 56);
  }

  std::uint32_t countBits();
  void makeOne(std::size_t place, int a, int b, int c, const Decode& decode);
  void toBytes(std::size_t slot, const float* samples);
  std::size_t freeSlot();
  template <class SlotOf>
  int copy(const CellChunk& cells, CornerChunk& out, std::int32_t* missing, const SlotOf& slotOf) const;

  std::array<int, 3> counts_{};
  std::vector<std::uint64_t> bits_;    // of every brick: is it there
  std::vector<std::uint32_t> before_;  // bricks before each word
  std::vector<Range> ranges_;          // per slot
  std::vector<std::uint8_t> bytes_;    // per slot
  // Of a set that is not whole.
  std::vector<std::uint32_t> slots_;   // of every brick of the set: its slot + 1, 0: none
  std::vector<std::uint32_t> owners_;  // per slot: its brick's place + 1, 0: free
  std::vector<std::uint8_t> used_;     // per slot: since the hand passed
  std::size_t hand_ = 0;               // the slot that goes next, unless it was used
};

}  // namespace ttsdf
