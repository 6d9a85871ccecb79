#pragma once
// The writer's side of range_decoder.h.

#include <cstdint>

#include "byte_writer.h"

namespace ttsdf {

class RangeEncoder {
 public:
  explicit RangeEncoder(ByteWriter& out) : out_(out) {}

  /// Stores a bit that is a 1 with a probability of so many 4096ths, and returns it.
  bool code(bool bit, int probability) {
    const std::uint32_t middle = low_ + ((high_ - low_) >> 12) * static_cast<std::uint32_t>(probability);
    (bit ? high_ : low_) = bit ? middle : middle + 1;
    while (((low_ ^ high_) & 0xFF000000u) == 0) {
      out_.u8(static_cast<std::uint8_t>(high_ >> 24));
      low_ <<= 8;
      high_ = high_ << 8 | 255u;
    }
    return bit;
  }

  void check() const {}
  /// After the last bit: what a reader needs to tell it.
  void flush() {
    for (int n = 3; n >= 0; --n) out_.u8(static_cast<std::uint8_t>(low_ >> (8 * n)));
  }

 private:
  ByteWriter& out_;
  std::uint32_t low_ = 0, high_ = 0xFFFFFFFFu;
};

}  // namespace ttsdf
