#pragma once
// Samples of a grid in bricks of 8 x 8 x 8, one byte each, of those parts only where somebody asks for them.
//
// A brick holds the corners of 7 x 7 x 7 cells and has a range of its own: its bytes are steps of a 255th of
// it. Distances change by one voxel per voxel at most, so a step is a twentieth of a voxel. Which bricks
// there are is one bit each; where they lie follows from how many bits are set before.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "grid_locator.h"

namespace ttsdf {

constexpr int kBrickCells = 7;               ///< cells along an edge
constexpr int kBrickSide = kBrickCells + 1;  ///< samples along an edge
constexpr int kBrickSamples = kBrickSide * kBrickSide * kBrickSide;

/// Once filled it is only read, from any number of threads.
class QuantizedBricks {
 public:
  using Id = std::size_t;

  QuantizedBricks() = default;
  /// Bricks that cover a grid of `sizes` samples; none of them is there.
  explicit QuantizedBricks(const std::array<int, 3>& sizes);

  /// Bricks along each axis.
  const std::array<int, 3>& counts() const { return counts_; }
  Id idOf(int a, int b, int c) const {
    return static_cast<Id>(a) + static_cast<Id>(counts_[0]) *
                                    (static_cast<Id>(b) + static_cast<Id>(counts_[1]) * static_cast<Id>(c));
  }
  std::size_t idCount() const {
    return static_cast<std::size_t>(counts_[0]) * static_cast<std::size_t>(counts_[1]) *
           static_cast<std::size_t>(counts_[2]);
  }

  /// Says that a brick will be there; all of them before the first `set`.
  void reserve(Id id) { bits_[id >> 6] |= std::uint64_t{1} << (id & 63); }
  /// Counts and makes room. Afterwards the set of bricks is fixed.
  void allocate();
  bool has(Id id) const { return (bits_[id >> 6] >> (id & 63)) & 1u; }
  std::size_t size() const { return ranges_.size(); }
  /// Samples, first axis fastest; not finite ones count as 0.
  void set(Id id, const float* samples);

  /// Corners of the cells of a chunk. Points whose brick is missing are noted in `missing` (their corners are
  /// left as they are); how many there are.
  int corners(const CellChunk& cells, CornerChunk& out, std::int32_t* missing) const;

  /// Bytes held.
  std::size_t memoryBytes() const;
  /// Of `count` bricks in a grid of `sizes` samples.
  static std::size_t bytesFor(const std::array<int, 3>& sizes, std::size_t count);
  static std::array<int, 3> countsFor(const std::array<int, 3>& sizes);

 private:
  struct Range {
    float lowest, step;
  };
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

  std::array<int, 3> counts_{};
  std::vector<std::uint64_t> bits_;    // of every brick: is it there
  std::vector<std::uint32_t> before_;  // bricks before each word
  std::vector<Range> ranges_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace ttsdf
