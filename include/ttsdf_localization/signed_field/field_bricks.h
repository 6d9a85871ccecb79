#pragma once
// A clamped field in about a byte per sample, for grids whose dense arrays would not fit the memory: bricks
// of 8^3 samples of 16 bits each, and one number for a brick that is constant.

#include <cstdint>
#include <memory>
#include <vector>

#include "ttsdf_localization/tensor/dense_tensor.h"

namespace ttsdf {

class FieldBricks {
 public:
  static constexpr int kSide = 8;

  FieldBricks() = default;
  /// Every sample unknown and loose. Values are kept to half of (high - low) / 32766, and low and high
  /// exactly. Throws std::invalid_argument for an extent below 1 or low >= high.
  FieldBricks(const Dims& dims, float low, float high);

  const Dims& dims() const { return dims_; }
  std::size_t memoryBytes() const;

  /// Samples of a box; strides: steps in the arrays along each axis.
  struct Samples {
    const float* values;                ///< [m]
    const std::uint8_t *known, *loose;  ///< loose: the value means nothing
    Eigen::Array<std::ptrdiff_t, 3, 1> strides;
  };

  /// Takes the samples [begin, begin + size). `begin` is a multiple of kSide, and so is the end unless it is
  /// the grid's. Boxes that do not overlap may be stored by several threads at once. Throws
  /// std::invalid_argument for other boxes.
  void store(const Dims& begin, const Dims& size, const Samples& samples);

  /// Once all is stored: gives the loose samples, and all that were never stored, a smooth course between the
  /// others. It is made for the whole grid at once, from the means of the bricks, so boxes leave no seams.
  void fillLoose(int threads);

  /// The samples whose index along `axis` is `index`, in a range of axis `columns` that begins at a multiple
  /// of kSide: axis `rows` fastest, then axis `columns`. `values` and `known` (which may be null) have room
  /// for all of them.
  struct Slab {
    int axis, index, rows, columns;
    int begin, size;  ///< range along `columns`
  };
  void readSlab(const Slab& slab, float* values, std::uint8_t* known) const;

 private:
  using Brick = std::unique_ptr<std::uint16_t[]>;

  std::uint16_t encode(float value, bool known) const;
  float decode(std::uint16_t code) const { return low_ + step_ * static_cast<float>(code >> 1); }
  void storeBrick(const Dims& brick, const Dims& count, const Samples& samples, std::ptrdiff_t start);
  void fillBrick(const Dims& brick);
  std::size_t brickOffset(const Dims& brick) const;

  Dims dims_ = Dims::Zero(), bricks_ = Dims::Zero();
  float low_ = 0.0F, step_ = 0.0F;
  std::vector<Brick> samples_;           // null: constant
  std::vector<std::uint16_t> constant_;  // per brick, where it is
  DenseTensor means_;                    // per brick, of the samples that are not loose
  std::vector<std::uint8_t> all_loose_;  // bricks without such a sample
};

}  // namespace ttsdf
